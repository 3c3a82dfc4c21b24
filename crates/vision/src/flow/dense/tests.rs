use super::*;
use crate::flow::tests::{noise, texture};
use pursuit_geometry::Point;
use pursuit_imaging::Image;

/// A patch by definition, in double precision: where it goes, and its differences there.
fn slow_patch(
    [first, second]: [&Image<u8>; 2],
    (left, top): (usize, usize),
    params: &DenseFlowParams,
) -> ((f64, f64), Vec<f64>) {
    let p = params.patch_px;
    let at = |image: &Image<u8>, x: f64, y: f64| {
        let (i, j) = (x.floor(), y.floor());
        let (fx, fy) = (x - i, y - j);
        let pixel = |dx: f64, dy: f64| f64::from(image.view().clamped((i + dx) as isize, (j + dy) as isize));
        (1.0 - fy) * ((1.0 - fx) * pixel(0.0, 0.0) + fx * pixel(1.0, 0.0))
            + fy * ((1.0 - fx) * pixel(0.0, 1.0) + fx * pixel(1.0, 1.0))
    };
    let places: Vec<(f64, f64)> = (0..p * p).map(|i| ((left + i % p) as f64, (top + i / p) as f64)).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let centered = |values: Vec<f64>| {
        let mean = if params.normalized { mean(&values) } else { 0.0 };
        values.into_iter().map(|v| v - mean).collect::<Vec<f64>>()
    };
    let template = centered(places.iter().map(|&(x, y)| at(first, x, y)).collect());
    let gx = centered(places.iter().map(|&(x, y)| (at(first, x + 1.0, y) - at(first, x - 1.0, y)) / 2.0).collect());
    let gy = centered(places.iter().map(|&(x, y)| (at(first, x, y + 1.0) - at(first, x, y - 1.0)) / 2.0).collect());
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let more = (p * p) as f64 * params.damping;
    let (xx, xy, yy) = (dot(&gx, &gx) + more, dot(&gx, &gy), dot(&gy, &gy) + more);
    let off = |u: f64, v: f64| -> Vec<f64> {
        let seen = centered(places.iter().map(|&(x, y)| at(second, x + u, y + v)).collect());
        seen.iter().zip(&template).map(|(s, t)| s - t).collect()
    };
    let (mut u, mut v) = (0.0, 0.0);
    for _ in 0..params.iterations {
        let d = off(u, v);
        let (x, y, determinant) = (dot(&gx, &d), dot(&gy, &d), xx * yy - xy * xy);
        let (dx, dy) = ((yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant);
        (u, v) = (u - dx, v - dy);
        if dx.hypot(dy) < f64::from(search::SETTLED_PX) {
            break;
        }
    }
    if u.hypot(v) > p as f64 {
        (u, v) = (0.0, 0.0);
    }
    let d = off(u, v);
    ((u, v), d)
}

/// Equation (3) by definition: of every pixel the weighted mean over the patches that it lies in.
fn slow(images: [&Image<u8>; 2], params: &DenseFlowParams) -> FlowField {
    let (size, p) = (images[0].size(), params.patch_px);
    let places = |length: usize| {
        let mut places: Vec<usize> = (0..length - p).step_by(params.step()).collect();
        places.push(length - p);
        places
    };
    let mut patches = Vec::new();
    for top in places(size.height) {
        for left in places(size.width) {
            patches.push(((left, top), slow_patch(images, (left, top), params)));
        }
    }
    FlowField::from_fn(size, |x, y| {
        let (mut sums, mut weights) = ([0.0; 2], 0.0);
        for ((left, top), ((u, v), off)) in &patches {
            if (*left..left + p).contains(&x) && (*top..top + p).contains(&y) {
                let weight = 1.0 / off[(y - top) * p + x - left].abs().max(1.0);
                sums = [sums[0] + weight * u, sums[1] + weight * v];
                weights += weight;
            }
        }
        sums.map(|s| (s / weights) as f32)
    })
    .unwrap()
}

fn pyramids(images: [&Image<u8>; 2]) -> [Pyramid; 2] {
    images.map(|i| Pyramid::of(i.view(), Pyramid::MAX_LEVELS).unwrap())
}

pub(super) fn flow(images: [&Image<u8>; 2], params: DenseFlowParams) -> FlowField {
    let [from, to] = pyramids(images);
    let mut field = FlowField::zero(Size::new(1, 1)).unwrap();
    DenseFlow::new(params).unwrap().estimate(&from, &to, &mut field).unwrap();
    field
}

#[test]
fn one_level_equals_the_definition() {
    let first = texture(90, 60, [256, 0, 300_000, 0, 256, 300_000]);
    let second = texture(90, 60, [258, 4, 299_600, -3, 254, 300_300]);
    for (patch_px, overlap, normalized, damping) in
        [(8, 0.5, true, 0.0), (8, 0.4, false, 1.0), (8, 0.3, true, 1.0), (12, 0.75, true, 0.0), (12, 0.0, false, 0.0)]
    {
        let refinement = RefinementParams { rounds: 0, ..RefinementParams::default() };
        let params = DenseFlowParams {
            finest: 0,
            patch_px,
            overlap,
            normalized,
            damping,
            reach: 0.01,
            iterations: 12,
            refinement,
        };
        assert_eq!(params.coarsest(first.size()), 0);
        let (fast, slow) = (flow([&first, &second], params), slow([&first, &second], &params));
        let off = |(a, b): (&[f32; 2], &[f32; 2])| (a[0] - b[0]).hypot(a[1] - b[1]);
        let mut apart: Vec<f32> = fast.image().as_slice().iter().zip(slow.image().as_slice()).map(off).collect();
        apart.sort_by(f32::total_cmp);
        let at = |share: f64| apart[(share * (apart.len() - 1) as f64) as usize];
        // A search that wanders may settle elsewhere for a rounding.
        assert!(at(0.5) < 1e-3 && at(0.98) < 0.05, "{patch_px} {normalized}: {} {} {}", at(0.5), at(0.98), at(1.0));
        let longest = slow.image().as_slice().iter().map(|m| m[0].hypot(m[1])).fold(0.0, f32::max);
        assert!(longest > 1.0, "there is something to compare: {longest}");
    }
}

/// Two views of a texture by affine maps (1/256 pixels), and where the pixels of the first are in the second.
pub(super) fn warped(size: Size, map: [i64; 6]) -> ([Image<u8>; 2], FlowField) {
    let from = [256, 0, 500_000, 0, 256, 500_000];
    let images = [from, map].map(|m| texture(size.width, size.height, m));
    let [a, b, tx, c, d, ty] = map.map(|v| v as f64);
    let determinant = a * d - b * c;
    let truth = FlowField::from_fn(size, |x, y| {
        let (u, v) = (256.0 * x as f64 + 500_000.0 - tx, 256.0 * y as f64 + 500_000.0 - ty);
        let to = ((d * u - b * v) / determinant, (a * v - c * u) / determinant);
        [(to.0 - x as f64) as f32, (to.1 - y as f64) as f32]
    });
    (images, truth.unwrap())
}

/// The map whose second view is turned by `degrees` and enlarged by `zoom` about the middle, and shifted.
pub(super) fn similar(size: Size, degrees: f64, zoom: f64, (dx, dy): (f64, f64)) -> [i64; 6] {
    let (s, c) = degrees.to_radians().sin_cos();
    let (mx, my) = (size.width as f64 / 2.0, size.height as f64 / 2.0);
    let rows = [[c / zoom, s / zoom], [-s / zoom, c / zoom]];
    let offset = |row: [f64; 2], m: f64| 500_000.0 + 256.0 * (m - row[0] * (mx + dx) - row[1] * (my + dy));
    let whole = |v: f64| v.round() as i64;
    let ([a, b], [d, e]) = (rows[0], rows[1]);
    [256.0 * a, 256.0 * b, offset(rows[0], mx), 256.0 * d, 256.0 * e, offset(rows[1], my)].map(whole)
}

/// Mean distance, and that of the pixels whose motion stays `margin` pixels inside.
pub(super) fn errors(found: &FlowField, truth: &FlowField, margin: f32) -> (f64, f64) {
    let size = truth.size();
    let (mut sum, mut count) = (0.0, 0usize);
    for y in 0..size.height {
        for x in 0..size.width {
            let (motion, true_motion) = (found.get(x, y).unwrap(), truth.get(x, y).unwrap());
            let to = [x as f32 + true_motion[0], y as f32 + true_motion[1]];
            let inside = |at: f32, from: usize, n: usize| {
                let n = n as f32 - margin;
                (margin..n).contains(&at) && (margin..n).contains(&(from as f32))
            };
            if inside(to[0], x, size.width) && inside(to[1], y, size.height) {
                sum += f64::from((motion[0] - true_motion[0]).hypot(motion[1] - true_motion[1]));
                count += 1;
            }
        }
    }
    assert!(2 * count > size.area());
    (found.end_point_error(truth).unwrap(), sum / count as f64)
}

#[test]
fn shifts_turns_and_zooms_are_found_to_a_fraction_of_a_pixel() {
    let size = Size::new(320, 240);
    // Name, map, most mean error inside. A patch of eight pixels at half of the resolution moves as one: where the motion changes from
    // pixel to pixel by 7 % its corners are half a pixel off.
    for (name, map, most) in [
        ("a shift", similar(size, 0.0, 1.0, (5.4, -3.3)), 0.08),
        ("a long shift", similar(size, 0.0, 1.0, (31.0, 17.5)), 0.15),
        ("a turn", similar(size, 4.0, 1.0, (1.0, 2.0)), 0.35),
        ("a zoom", similar(size, 0.0, 1.06, (0.0, -1.0)), 0.35),
        ("all of them", similar(size, -3.0, 0.95, (6.0, 4.0)), 0.35),
    ] {
        let ([first, second], truth) = warped(size, map);
        let (all, inside) = errors(&flow([&first, &second], DenseFlowParams::default()), &truth, 12.0);
        let still = errors(&FlowField::zero(size).unwrap(), &truth, 12.0).1;
        assert!(still > 3.0, "{name} moves {still}");
        // Of what leaves the picture a field can only guess.
        assert!(inside < most && all < 0.5 * still, "{name}: {inside} inside, {all} in all");
    }
}

#[test]
fn presets_of_the_paper_find_a_turn() {
    let size = Size::new(320, 240);
    let ([first, second], truth) = warped(size, similar(size, 2.0, 1.02, (4.0, -2.0)));
    for (params, most) in [(DenseFlowParams::kroeger2016_fast(), 1.5), (DenseFlowParams::kroeger2016_fine(), 0.15)] {
        let (_, inside) = errors(&flow([&first, &second], params), &truth, 16.0);
        assert!(inside < most, "{params:?}: {inside}");
    }
}

#[test]
fn two_layers_keep_their_motions_to_their_border() {
    let size = Size::new(240, 180);
    let back = |dx: i64, dy: i64| texture(240, 180, [256, 0, 400_000 - 256 * dx, 0, 256, 400_000 - 256 * dy]);
    let front = |dx: i64, dy: i64| texture(240, 180, [256, 0, 900_000 - 256 * dx, 0, 256, 700_000 - 256 * dy]);
    let is_front = |x: usize, y: usize, dx: i64, dy: i64| {
        (80..160).contains(&(x as i64 - dx)) && (50..130).contains(&(y as i64 - dy))
    };
    // The ground goes left by three pixels, the square in front right by seven and down by four.
    let picture = |back: &Image<u8>, front: &Image<u8>, dx: i64, dy: i64| {
        Image::from_fn(240, 180, |x, y| if is_front(x, y, dx, dy) { front.row(y)[x] } else { back.row(y)[x] }).unwrap()
    };
    let first = picture(&back(0, 0), &front(0, 0), 0, 0);
    let second = picture(&back(-3, 0), &front(7, 4), 7, 4);
    let truth = FlowField::from_fn(size, |x, y| if is_front(x, y, 0, 0) { [7.0, 4.0] } else { [-3.0, 0.0] }).unwrap();
    let found = flow([&first, &second], DenseFlowParams::default());
    let off = |x: usize, y: usize| {
        let (a, b) = (found.get(x, y).unwrap(), truth.get(x, y).unwrap());
        f64::from((a[0] - b[0]).hypot(a[1] - b[1]))
    };
    let mean = |pixels: Vec<(usize, usize)>| pixels.iter().map(|&(x, y)| off(x, y)).sum::<f64>() / pixels.len() as f64;
    let all = || (0..180).flat_map(|y| (0..240).map(move |x| (x, y)));
    let border = |x: usize, y: usize, by: i64| {
        is_front(x, y, 0, 0)
            != (is_front(x + by as usize, y, 0, 0)
                && is_front(x.saturating_sub(by as usize), y, 0, 0)
                && is_front(x, y + by as usize, 0, 0)
                && is_front(x, y.saturating_sub(by as usize), 0, 0))
    };
    let inner = mean(all().filter(|&(x, y)| is_front(x, y, 0, 0) && !border(x, y, 12)).collect());
    let outer = |&(x, y): &(usize, usize)| {
        (12..228).contains(&x) && (12..168).contains(&y) && !(64..176).contains(&x) || (y > 12 && y < 34)
    };
    let outer = mean(all().filter(outer).filter(|&(x, _)| (12..228).contains(&x)).collect());
    let whole = found.end_point_error(&truth).unwrap();
    assert!(inner < 0.15 && outer < 0.15, "{inner} in front, {outer} behind");
    assert!(whole < 1.2, "{whole} in all, the borders and what is uncovered with them");
}

#[test]
fn other_light_moves_nothing_where_means_do_not_count() {
    let size = Size::new(160, 120);
    let ([first, mut second], truth) = warped(size, similar(size, 0.0, 1.0, (2.5, 1.5)));
    second.as_mut_slice().iter_mut().for_each(|v| *v = v.saturating_add(25));
    let error = |normalized| {
        errors(&flow([&first, &second], DenseFlowParams { normalized, ..DenseFlowParams::default() }), &truth, 10.0).1
    };
    assert!(error(true) < 0.1, "{}", error(true));
    assert!(error(false) > 3.0 * error(true), "{}", error(false));
}

#[test]
fn still_and_flat_pictures_do_not_move() {
    let still = Image::from_fn(100, 80, |x, y| noise(x, y, 3) as u8).unwrap();
    let flat = Image::filled(100, 80, 77_u8).unwrap();
    for (a, b) in [(&still, &still), (&flat, &flat)] {
        let found = flow([a, b], DenseFlowParams::default());
        assert!(found.image().as_slice().iter().all(|m| m[0].hypot(m[1]) < 1e-3));
    }
    // What cannot be followed gives numbers all the same.
    let found = flow([&still, &flat], DenseFlowParams { damping: 0.0, ..DenseFlowParams::default() });
    assert!(found.image().as_slice().iter().flatten().all(|m| m.is_finite()));
}

/// A plain wall, shaded, as a sensor and a codec show it: errors of two grey codes, in single pixels and in blotches.
fn wall(seed: i64) -> Image<u8> {
    let blotch = |x: usize, y: usize| {
        let (i, j) = (x / 8, y / 8);
        let (a, b) = ((x % 8) as f64 / 8.0, (y % 8) as f64 / 8.0);
        let at = |i: usize, j: usize| (noise(i, j, 77 + seed).rem_euclid(5)) as f64 - 2.0;
        let row = |j: usize| at(i, j) + a * (at(i + 1, j) - at(i, j));
        row(j) + b * (row(j + 1) - row(j))
    };
    Image::from_fn(320, 240, |x, y| {
        let grain = (noise(x, y, seed).rem_euclid(5)) as f64 - 2.0;
        (180.0 + x as f64 / 20.0 + blotch(x, y) + grain).round() as u8
    })
    .unwrap()
}

#[test]
fn noise_on_a_plain_wall_is_no_motion() {
    let longest = |damping| {
        let found = flow([&wall(1), &wall(2)], DenseFlowParams { damping, ..DenseFlowParams::default() });
        let mut lengths: Vec<f32> = found.image().as_slice().iter().map(|m| m[0].hypot(m[1])).collect();
        lengths.sort_by(f32::total_cmp);
        lengths[lengths.len() * 99 / 100]
    };
    let (damped, plain) = (longest(DenseFlowParams::default().damping), longest(0.0));
    assert!(damped < 1.0 && plain > 10.0, "{damped} px damped, {plain} px as in the paper");
}

#[test]
fn small_and_unequal_pictures_and_bad_parameters_are_refused() {
    let mut estimator = DenseFlow::new(DenseFlowParams::default()).unwrap();
    let mut field = FlowField::zero(Size::new(1, 1)).unwrap();
    let pyramid = |w, h| Pyramid::of(Image::filled(w, h, 9).unwrap().view(), 5).unwrap();
    assert!(estimator.estimate(&pyramid(7, 40), &pyramid(7, 40), &mut field).is_err());
    assert!(estimator.estimate(&pyramid(40, 40), &pyramid(41, 40), &mut field).is_err());
    // The smallest there is, and one that is all border.
    for (w, h) in [(8, 8), (9, 64)] {
        estimator.estimate(&pyramid(w, h), &pyramid(w, h), &mut field).unwrap();
        assert_eq!(field.size(), Size::new(w, h));
    }
    assert_eq!(estimator.levels(Size::new(640, 480)), 6);
    let params = DenseFlowParams::default();
    for bad in [
        DenseFlowParams { finest: 7, ..params },
        DenseFlowParams { patch_px: 7, ..params },
        DenseFlowParams { overlap: 0.95, ..params },
        DenseFlowParams { iterations: 0, ..params },
        DenseFlowParams { reach: 0.0, ..params },
        DenseFlowParams { damping: f64::NAN, ..params },
        DenseFlowParams { refinement: RefinementParams { rounds: 21, ..params.refinement }, ..params },
        DenseFlowParams { refinement: RefinementParams { sweeps: 0, ..params.refinement }, ..params },
        DenseFlowParams { refinement: RefinementParams { smoothness: 0.0, ..params.refinement }, ..params },
        DenseFlowParams { refinement: RefinementParams { gradients: f64::NAN, ..params.refinement }, ..params },
    ] {
        assert!(DenseFlow::new(bad).is_err(), "{bad:?}");
    }
}

#[test]
fn fields_go_to_files_and_back_and_bad_files_are_refused() {
    let field = FlowField::from_fn(Size::new(5, 3), |x, y| [x as f32 - 2.5, 10.0 * y as f32]).unwrap();
    let bytes = field.to_flo();
    assert_eq!(bytes[..4], 202_021.25_f32.to_le_bytes());
    assert_eq!((&bytes[4..8], &bytes[8..12], bytes.len()), (&[5, 0, 0, 0][..], &[3, 0, 0, 0][..], 12 + 5 * 3 * 8));
    assert_eq!(FlowField::from_flo(&bytes).unwrap(), field);
    assert_eq!(FlowField::from_flo(b"JPEG and more of it"), Err(FloError::Magic));
    assert_eq!(FlowField::from_flo(b"JP"), Err(FloError::Magic));
    assert_eq!(FlowField::from_flo(&bytes[..9]), Err(FloError::Length { found: 9, expected: 12 }));
    assert_eq!(FlowField::from_flo(&bytes[..100]), Err(FloError::Length { found: 100, expected: 132 }));
    let mut vast = bytes;
    vast[4..8].copy_from_slice(&i32::MAX.to_le_bytes());
    assert_eq!(FlowField::from_flo(&vast), Err(FloError::Size { width: i32::MAX, height: 3 }));
}

#[test]
fn motions_between_pixels_are_interpolated() {
    let field = FlowField::from_fn(Size::new(4, 4), |x, y| [x as f32, 2.0 * y as f32]).unwrap();
    assert_eq!(field.at(Point::new(1.75, 2.0)), [1.25, 3.0]);
    assert_eq!(field.at(Point::new(-9.0, 99.0)), [0.0, 6.0]);
}
