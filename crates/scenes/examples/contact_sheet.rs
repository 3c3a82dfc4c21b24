//! Renders moments of a scene side by side, to look at:
//! `cargo run --release -p pursuit-scenes --example contact_sheet -- 'scene:table-tennis?seed=1' sheet.png [COLUMNS ROWS [FROM_S TO_S [PAN_DEG TILT_DEG [FOV_DEG]]]]`
//! Boxes show the truth; their brightness shows how much of the target can be seen. Prints the time per frame. Depth is
//! shown in the place of the picture where a scene has it and the file's name contains `depth`.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [query, path, rest @ ..] = arguments.as_slice() else {
        return Err(
            "usage: contact_sheet QUERY FILE.png [COLUMNS ROWS [FROM_S TO_S [PAN_DEG TILT_DEG [FOV_DEG]]]]".into()
        );
    };
    let number = |k: usize, default: f64| rest.get(k).map_or(Ok(default), |t| t.parse::<f64>());
    let scene = pursuit_scenes::open(query)?;
    let (columns, rows) = (number(0, 4.0)? as usize, number(1, 4.0)? as usize);
    let (from, to) = (number(2, 0.0)?, number(3, scene.duration_s())?);
    let aimed = scene.home().aimed(number(4, 0.0)?.to_radians(), number(5, 0.0)?.to_radians());
    let mut view = if rest.len() > 4 { aimed.ok_or("no camera has such a tilt")? } else { scene.home() };
    if rest.len() > 6 {
        view = view.zoomed(number(6, 60.0)?.to_radians()).ok_or("no lens is that wide")?;
    }
    let size = view.size;
    let mut sheet = vec![[0u8; 3]; columns * rows * size.area()];
    let mut rendering = std::time::Duration::ZERO;
    for k in 0..columns * rows {
        let time_s = from + (to - from) * k as f64 / (columns * rows) as f64;
        let start = Instant::now();
        let mut moment = scene.render_view((time_s * scene.fps()).round() / scene.fps(), &view);
        rendering += start.elapsed();
        if let Some(depth) = moment.depth_mm.take().filter(|_| path.contains("depth")) {
            let shades =
                depth.as_slice().iter().map(|mm| if *mm == 0 { [60, 0, 0] } else { [(mm / 18).min(255) as u8; 3] });
            moment.image.as_mut_slice().iter_mut().zip(shades).for_each(|(to, shade)| *to = shade);
        }
        let at = |x: usize, y: usize| {
            ((k / columns) * size.height + y) * columns * size.width + (k % columns) * size.width + x
        };
        for (y, row) in moment.image.view().rows().enumerate() {
            sheet[at(0, y)..at(0, y) + size.width].copy_from_slice(row);
        }
        let Some(bbox) = moment.targets[0].extent.and_then(|b| b.expanded(1.0).clipped_to(size)) else { continue };
        let color = [0, (80.0 + 175.0 * moment.targets[0].visible_fraction) as u8, 80];
        let (left, top) = (bbox.left() as usize, bbox.top() as usize);
        let (right, bottom) =
            ((bbox.right() as usize).min(size.width - 1), (bbox.bottom() as usize).min(size.height - 1));
        (left..=right).for_each(|x| [top, bottom].into_iter().for_each(|y| sheet[at(x, y)] = color));
        (top..=bottom).for_each(|y| [left, right].into_iter().for_each(|x| sheet[at(x, y)] = color));
    }
    println!("{:.2} ms a frame", rendering.as_secs_f64() * 1e3 / (columns * rows) as f64);
    let (width, height) = ((columns * size.width) as u32, (rows * size.height) as u32);
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(sheet.as_flattened())?;
    Ok(())
}
