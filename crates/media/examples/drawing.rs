//! Draws everything a canvas can on a moving background, writes an MP4 and its last picture, and says how fast that was:
//! `cargo run --release -p pursuit-media --example drawing -- FOLDER [WIDTH HEIGHT [FRAMES]]`

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Image;
use pursuit_media::output::{Canvas, Mp4Writer, Stroke, VideoOptions, VideoWriter, write_png};
use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = Path::new(arguments.first().ok_or("usage: drawing FOLDER [WIDTH HEIGHT [FRAMES]]")?);
    let number = |k: usize, default: usize| arguments.get(k).map_or(Ok(default), |t| t.parse());
    let (width, height, frames) = (number(1, 640)?, number(2, 480)?, number(3, 90)?);
    let mut video = Mp4Writer::create(&folder.join("drawing.mp4"), VideoOptions::default())?;
    let (mut drawing, mut encoding) = (Duration::ZERO, Duration::ZERO);
    let mut trail = Vec::new();
    for k in 0..frames {
        let background = Image::from_fn(width, height, |x, y| {
            let (x, y) = (x * 640 / width + k, y * 480 / height);
            [(60 + (x / 3) % 120) as u8, (70 + ((x ^ y) % 64)) as u8, (60 + (y / 4) % 100) as u8]
        })?;
        let start = Instant::now();
        let canvas = draw(Canvas::new(background), k as f64 / 30.0, &mut trail);
        drawing += start.elapsed();
        let start = Instant::now();
        video.write(canvas.image().view(), k as f64 / 30.0)?;
        encoding += start.elapsed();
        if k + 1 == frames {
            write_png(&folder.join("drawing.png"), canvas.image().view())?;
        }
    }
    video.finish()?;
    let each = |d: Duration| d.as_secs_f64() * 1e3 / frames as f64;
    println!("{width}x{height}: drawing {:.2} ms, encoding {:.2} ms a frame", each(drawing), each(encoding));
    Ok(())
}

fn draw(mut canvas: Canvas, time_s: f64, trail: &mut Vec<Option<Point>>) -> Canvas {
    let (green, red, white) = ([60, 220, 80], [235, 60, 50], [245, 245, 245]);
    let (scale, size) = (canvas.scale(), canvas.image().size());
    let (w, h) = (size.width as f64, size.height as f64);
    let center = Point::new(w * (0.5 + 0.3 * (1.3 * time_s).sin()), h * (0.55 + 0.25 * (2.1 * time_s).cos()));
    trail.push(Some(center));
    if trail.len() > 60 {
        trail.remove(0);
    }
    let measured = BBox::from_center_size(center, 0.13 * w, 0.17 * h);
    canvas.trail(trail, &Stroke::new([250, 210, 60], 2.0 * scale));
    canvas.rectangle(&measured.translated(5.3 * scale, -3.6 * scale), &Stroke::new(red, 2.0 * scale));
    canvas.rectangle(&measured, &Stroke::new(green, 2.0 * scale));
    canvas.rectangle(&measured.scaled(1.5), &Stroke::new(white, 1.5 * scale).dashed(8.0 * scale, 5.0 * scale));
    canvas.cross(center, 7.0 * scale, &Stroke::new(green, 1.5 * scale));
    canvas.dot(center, 2.5 * scale, red, 1.0);
    canvas.label(&measured.scaled(1.5), "ball 1  tracking 0.97", white);
    canvas.label(
        &BBox::from_ltwh(4.0, 0.0, 1.0, 0.0),
        &format!("frame {:04}  {time_s:.2} s", (time_s * 30.0).round()),
        [255, 226, 120],
    );
    canvas
}
