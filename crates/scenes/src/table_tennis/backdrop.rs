use super::camera::{HEIGHT_M, ray};
use super::{TableTennis, World};
use crate::hash;
use crate::texture::{Color, Texture, fractal_noise, hsv, mixed, scaled, smooth_step, value_noise};
use pursuit_geometry::Point;

/// Half width and far end of the table, height and place of the net (2.74 × 1.525 m, 15.25 cm), in metres.
const TABLE_HALF_WIDTH: f64 = 0.7625;
const TABLE_END: f64 = 3.12;
const NET_Z: f64 = 1.75;
const NET_HEIGHT: f64 = 0.1525;
const NET_HALF_WIDTH: f64 = 0.915;
const FLOOR_Y: f64 = -0.76;
const WALL_Z: f64 = 5.2;

/// Everything that never moves.
pub(super) fn paint(seed: u64) -> Texture {
    let key = hash::mix(seed, 0x7ab1e);
    let posters: Vec<Poster> = (0..9).map(|k| Poster::random(key, k)).collect();
    Texture::paint(TableTennis::SIZE.width, TableTennis::SIZE.height, 3, |u, v| {
        let ray = ray(Point::new(u, v));
        let behind = behind_net(key, &posters, ray);
        let net = at(ray, NET_Z / ray.z);
        // The net's plane counts only where it is nearer than the table's surface.
        let on_net = net.y > 0.0 && net.y < NET_HEIGHT && net.x.abs() < NET_HALF_WIDTH;
        let color = if on_net { net_color(net, behind) } else { behind };
        let (x, y) = ((u - 320.0) / 400.0, (v - 240.0) / 400.0);
        scaled(color, (1.0 - 0.16 * (x * x + y * y)) as f32)
    })
}

fn at(ray: World, along: f64) -> World {
    World { x: ray.x * along, y: HEIGHT_M + ray.y * along, z: ray.z * along }
}

fn behind_net(key: u64, posters: &[Poster], ray: World) -> Color {
    if ray.y < 0.0 {
        let on_table = at(ray, -HEIGHT_M / ray.y);
        if on_table.x.abs() < TABLE_HALF_WIDTH && on_table.z < TABLE_END {
            return table_color(key, on_table);
        }
        let on_floor = at(ray, (FLOOR_Y - HEIGHT_M) / ray.y);
        if on_floor.z < WALL_Z {
            return floor_color(key, on_floor);
        }
    }
    wall_color(key, posters, at(ray, WALL_Z / ray.z))
}

fn table_color(key: u64, p: World) -> Color {
    let to_edge = (TABLE_HALF_WIDTH - p.x.abs()).min(TABLE_END - p.z);
    if to_edge < 0.02 || p.x.abs() < 0.0025 {
        return [226.0, 230.0, 232.0];
    }
    let speckle = fractal_noise(key, p.x * 260.0, p.z * 260.0, 2) as f32;
    let worn = fractal_noise(key ^ 9, p.x * 9.0, p.z * 5.0, 4) as f32;
    let scratches = value_noise(key ^ 5, p.x * 30.0 + p.z * 4.0, p.z * 2.0 - p.x * 300.0).powi(6) as f32;
    // Varnish mirrors the bright window the more, the flatter one looks.
    let gloss = (0.30 * smooth_step(0.6, 3.0, p.z) * (1.0 - smooth_step(0.1, 0.75, (p.x + 0.12).abs()))) as f32;
    let paint = hsv(213.0, 0.70, 0.56).map(|c| c + 11.0 * speckle + 13.0 * worn + 22.0 * scratches);
    mixed(paint, [176.0, 196.0, 214.0], gloss)
}

fn net_color(p: World, behind: Color) -> Color {
    if p.y > NET_HEIGHT - 0.016 {
        let fold = 8.0 * (p.x * 60.0).sin() as f32;
        return [222.0 + fold, 224.0 + fold, 222.0 + fold];
    }
    // Knotted cord with meshes of 9 mm.
    let off_cord = |t: f64| (t / 0.009 - (t / 0.009).floor() - 0.5).abs();
    let cord = off_cord(p.x) > 0.40 || off_cord(p.y) > 0.40;
    if cord { mixed(behind, [30.0, 34.0, 38.0], 0.85) } else { scaled(behind, 0.86) }
}

fn floor_color(key: u64, p: World) -> Color {
    let plank = (p.x / 0.14).floor();
    let tone = hash::between(key, (plank as i64) as u64, 0.85, 1.1);
    let grain = fractal_noise(key ^ 2, p.x * 60.0, p.z * 4.0, 3);
    scaled([112.0, 84.0, 62.0], (tone + 0.15 * grain) as f32)
}

fn wall_color(key: u64, posters: &[Poster], p: World) -> Color {
    let stain = fractal_noise(key ^ 4, p.x * 1.2, p.y * 1.2, 4);
    let tone = 0.74 + 0.05 * p.y + 0.12 * stain;
    let wall = scaled([196.0, 190.0, 178.0], tone as f32);
    let mut color = mixed(wall, [70.0, 66.0, 62.0], smooth_step(-0.55, -0.62, p.y) as f32);
    for poster in posters {
        color = poster.over(color, p);
    }
    color
}

/// Something flat and out of focus on the wall.
struct Poster {
    left: f64,
    bottom: f64,
    width: f64,
    height: f64,
    color: Color,
    stripe: Color,
    stripes: f64,
}

impl Poster {
    fn random(key: u64, index: u64) -> Self {
        let key = hash::mix(key, 500 + index);
        let number = |k, low, high| hash::between(key, k, low, high);
        Self {
            // Spread over the wall, so that they do not all heap up in one place.
            left: -2.6 + 0.56 * index as f64 + number(0, -0.15, 0.15),
            bottom: number(1, -0.35, 0.35),
            width: number(2, 0.22, 0.6),
            height: number(3, 0.25, 0.75),
            color: hsv(number(4, 0.0, 360.0), number(5, 0.15, 0.55), number(6, 0.3, 0.8)),
            stripe: hsv(number(7, 0.0, 360.0), number(8, 0.1, 0.5), number(9, 0.3, 0.9)),
            stripes: number(10, 6.0, 22.0),
        }
    }

    fn over(&self, under: Color, p: World) -> Color {
        // Blurred by 2 cm: the lens is focused on the ball.
        let soft = |d: f64| smooth_step(-0.02, 0.02, d);
        let (x, y) = (p.x - self.left, p.y - self.bottom);
        let cover = soft(x) * soft(self.width - x) * soft(y) * soft(self.height - y);
        let band = smooth_step(-0.4, 0.4, (y * self.stripes).sin()) * smooth_step(0.0, 0.06, self.width * 0.7 - x);
        mixed(under, mixed(self.color, self.stripe, band as f32), cover as f32)
    }
}
