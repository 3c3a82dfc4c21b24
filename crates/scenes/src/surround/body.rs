//! What walks about: an articulated person, or a ball. Lengths in metres, across to the right, height above the floor.

use super::Stand;
use crate::hash;
use crate::texture::{Color, fractal_noise, hsv, mixed, scaled};

/// A look, chosen by a seed.
pub(super) struct Body {
    kind: Kind,
    key: u64,
    skin: Color,
    hair: Color,
    shirt: Color,
    trousers: Color,
    /// Height of a person over that of the model, 1.75 m.
    stature: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Person,
    Ball,
}

/// A line thickened by a radius, and the colour it is painted in.
#[derive(Clone, Copy)]
pub(super) struct Limb {
    from: [f64; 2],
    to: [f64; 2],
    radius: f64,
    cloth: Cloth,
}

#[derive(Clone, Copy, PartialEq)]
enum Cloth {
    Skin,
    Hair,
    Shirt,
    /// The arm and leg on the far side lie in the shade.
    ShirtBehind,
    Trousers,
    TrousersBehind,
    Shoe,
    Stripes,
}

/// How far legs swing forwards and backwards, in radians, and the length of a step pair, in metres (an easy walk).
const SWING_RAD: f64 = 0.42;
const STRIDE_M: f64 = 1.4;
/// Half of a large ball's diameter.
pub(super) const BALL_RADIUS_M: f64 = 0.17;

impl Body {
    pub(super) fn person(seed: u64) -> Self {
        let key = hash::mix(seed, 0x9e05);
        let random = |k, low, high| hash::between(key, k, low, high);
        let shirt_hue = random(0, 0.0, 360.0);
        Self {
            kind: Kind::Person,
            key,
            skin: scaled([224.0, 178.0, 152.0], random(1, 0.5, 1.0) as f32),
            hair: hsv(random(2, 15.0, 45.0), 0.5, random(3, 0.1, 0.5)),
            shirt: hsv(shirt_hue, random(4, 0.45, 0.85), random(5, 0.45, 0.95)),
            trousers: hsv(shirt_hue + random(6, 90.0, 270.0), random(7, 0.1, 0.5), random(8, 0.12, 0.4)),
            stature: random(9, 0.93, 1.08),
        }
    }

    pub(super) fn ball(seed: u64) -> Self {
        let person = Self::person(seed);
        Self { kind: Kind::Ball, shirt: hsv(hash::between(person.key, 20, 0.0, 360.0), 0.85, 0.95), ..person }
    }

    /// The parts from back to front.
    pub(super) fn limbs(&self, stand: &Stand) -> Vec<Limb> {
        if self.kind == Kind::Ball {
            let middle = [0.0, BALL_RADIUS_M];
            return vec![Limb { from: middle, to: middle, radius: BALL_RADIUS_M, cloth: Cloth::Stripes }];
        }
        let swing = stand.pace * SWING_RAD * (std::f64::consts::TAU * stand.walked_m / (STRIDE_M * self.stature)).sin();
        let ahead = stand.facing;
        let limb = |from: [f64; 2], to: [f64; 2], radius: f64, cloth| {
            let size = |p: [f64; 2]| p.map(|v| v * self.stature);
            Limb { from: size(from), to: size(to), radius: radius * self.stature, cloth }
        };
        // A limb that hangs from a joint, turned forwards by an angle.
        let hung = |joint: [f64; 2], length: f64, angle: f64| {
            [joint[0] + ahead * length * angle.sin(), joint[1] - length * angle.cos()]
        };
        let leg = |angle: f64, side: f64, cloth| {
            let hip = [side, 0.90];
            // The knee of the leg that lags behind gives way, which lifts its foot.
            let knee = hung(hip, 0.42, angle);
            let foot = hung(knee, 0.42, angle - 0.5 * (-angle).max(0.0));
            let toe = [foot[0] + ahead * 0.14, foot[1] - 0.02];
            [limb(hip, knee, 0.085, cloth), limb(knee, foot, 0.065, cloth), limb(foot, toe, 0.04, Cloth::Shoe)]
        };
        let arm = |angle: f64, side: f64, cloth| {
            let shoulder = [side, 1.38];
            let elbow = hung(shoulder, 0.29, angle);
            let hand = hung(elbow, 0.27, angle + 0.25);
            [limb(shoulder, elbow, 0.055, cloth), limb(elbow, hand, 0.045, Cloth::Skin)]
        };
        // Who stands is seen broader, arms and legs beside each other.
        let side = 0.10 * (1.0 - stand.pace);
        let mut limbs = Vec::with_capacity(13);
        limbs.extend(arm(swing, -1.6 * side, Cloth::ShirtBehind));
        limbs.extend(leg(-swing, -side, Cloth::TrousersBehind));
        limbs.extend(leg(swing, side, Cloth::Trousers));
        limbs.push(limb([0.0, 0.98], [0.0, 1.32], 0.15 + 0.5 * side, Cloth::Shirt));
        limbs.push(limb([0.0, 1.45], [0.0, 1.52], 0.06, Cloth::Skin));
        limbs.push(limb([-0.01 * ahead, 1.66], [-0.01 * ahead, 1.64], 0.115, Cloth::Hair));
        limbs.push(limb([0.03 * ahead, 1.62], [0.03 * ahead, 1.60], 0.095, Cloth::Skin));
        limbs.extend(arm(-swing, 1.6 * side, Cloth::Shirt));
        limbs
    }

    /// Colour times opacity, and opacity, at a point; edges are `pixel_m` soft.
    pub(super) fn sample(&self, limbs: &[Limb], stand: &Stand, [u, h]: [f64; 2], pixel_m: f64) -> [f32; 4] {
        let mut color = [0.0; 3];
        let mut clear = 1.0f32;
        for limb in limbs {
            let depth = limb.depth([u, h]);
            let cover = (depth / pixel_m + 0.5).clamp(0.0, 1.0) as f32;
            if cover > 0.0 {
                let round = (0.72 + 0.28 * (depth / limb.radius).clamp(0.0, 1.0).sqrt()) as f32;
                color = mixed(color, scaled(self.cloth(limb.cloth, stand, [u, h]), round), cover);
                clear *= 1.0 - cover;
            }
        }
        // Mixing over black has multiplied the colours by their opacity already.
        [color[0], color[1], color[2], 1.0 - clear]
    }

    fn cloth(&self, cloth: Cloth, stand: &Stand, [u, h]: [f64; 2]) -> Color {
        let grain = |color: Color, strength: f64| {
            let noise = fractal_noise(self.key, u * 16.0, h * 16.0, 2);
            scaled(color, (1.0 + strength * noise) as f32)
        };
        match cloth {
            Cloth::Skin => self.skin,
            Cloth::Hair => self.hair,
            Cloth::Shirt => grain(self.shirt, 0.5),
            Cloth::ShirtBehind => scaled(self.shirt, 0.55),
            Cloth::Trousers => grain(self.trousers, 0.3),
            Cloth::TrousersBehind => scaled(self.trousers, 0.6),
            Cloth::Shoe => [28.0, 26.0, 26.0],
            Cloth::Stripes => {
                let turned = (h - BALL_RADIUS_M).atan2(u) + stand.facing * stand.walked_m / BALL_RADIUS_M;
                mixed(self.shirt, [235.0; 3], if (3.0 * turned).sin() > 0.3 { 1.0 } else { 0.0 })
            }
        }
    }
}

impl Limb {
    /// How deep a point lies inside; negative outside.
    pub(super) fn depth(&self, [x, y]: [f64; 2]) -> f64 {
        let ([x0, y0], [dx, dy]) = (self.from, [self.to[0] - self.from[0], self.to[1] - self.from[1]]);
        let length2 = dx * dx + dy * dy;
        let along = if length2 > 0.0 { (((x - x0) * dx + (y - y0) * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
        self.radius - (x - x0 - along * dx).hypot(y - y0 - along * dy)
    }

    /// Points around its outline, close enough to find its edges to a hundredth of its radius.
    pub(super) fn outline(&self) -> impl Iterator<Item = [f64; 2]> + use<> {
        const POINTS: u32 = 24;
        let (ends, radius) = ([self.from, self.to], self.radius);
        ends.into_iter().flat_map(move |[x, y]| {
            (0..POINTS).map(move |k| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(POINTS)).sin_cos();
                [x + radius * cos, y + radius * sin]
            })
        })
    }
}
