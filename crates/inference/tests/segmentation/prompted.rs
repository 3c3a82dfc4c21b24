//! An encoder with a decoder that is asked by a box.

use super::*;

#[test]
fn a_box_asks_for_the_best_mask_in_the_frames_own_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let model = pair(folder.path(), &decoder([0.3, 0.9, 0.5]));
    for way in ways() {
        let mut network = SegmentationNetwork::open(&model, &way).unwrap();
        assert!(network.taken_for().contains("image encoder of 64 x 64"), "{}", network.taken_for());
        // As large as the picture, smaller and larger, wide and high; and the target at every border.
        for (width, height) in [(64, 48), (128, 96), (100, 75), (75, 100), (40, 30), (301, 97)] {
            let (w, h, radius) = (width as f64, height as f64, 0.3 * width.min(height) as f64);
            for (cx, cy) in
                [(0.55 * w, 0.5 * h), (w - 2.0, 0.4 * h), (0.5 * w, h), (w, h), (0.6 * w, 0.0), (0.2 * w, 0.5 * h)]
            {
                let image = frame(width, height, (cx, cy, radius));
                let bbox = BBox::from_center_size(pursuit_geometry::Point::new(cx, cy), 2.1 * radius, 1.9 * radius);
                let found = segmented(&mut network, &image, &bbox);
                let wanted = twin(&image, &bbox, [0, 0, width as i64, height as i64]);
                compare(&found, &wanted, &format!("{width} x {height}, {cx}, {cy}"));
            }
        }
        // A window of the frame is the same, cut.
        let image = frame(128, 96, (80.0, 40.0, 20.0));
        let bbox = BBox::from_ltwh(60.0, 20.0, 40.0, 40.0);
        let (all, mut cells) = (segmented(&mut network, &image, &bbox), Vec::new());
        network.segment(image.view(), &bbox, (50..90, 30..96), &mut cells).unwrap();
        let cut: Vec<bool> = (30..96).flat_map(|y| all[y * 128 + 50..y * 128 + 90].to_vec()).collect();
        assert_eq!(cells, cut);
        // What lies elsewhere is nobody's.
        for nowhere in [BBox::from_ltwh(-90.0, 3.0, 9.0, 9.0), BBox::from_ltwh(f64::NAN, 3.0, 9.0, 9.0)] {
            network.segment(image.view(), &nowhere, (0..10, 0..10), &mut cells).unwrap();
            assert!(cells.len() == 100 && cells.iter().all(|c| !c));
        }
        for vast in [BBox::from_ltwh(-1e9, -1e9, 2e9, 2e9), BBox::from_ltwh(63.9, 30.0, 1e-6, 1e-6)] {
            network.segment(image.view(), &vast, (0..128, 0..96), &mut cells).unwrap();
            assert_eq!(cells.len(), 128 * 96);
        }
    }
}

#[test]
fn a_description_names_the_files_and_shows_less_of_the_frame() {
    let folder = tempfile::tempdir().unwrap();
    pair(folder.path(), &decoder([0.3, 0.9, 0.5]));
    let toml = folder.path().join("mine.toml");
    std::fs::write(&toml, "encoder = 'small_encoder.onnx'\ndecoder = 'small_decoder.onnx'\ncontext = 0.5").unwrap();
    for way in ways() {
        let mut network = SegmentationNetwork::open(&toml, &way).unwrap();
        // A small target in a large frame: shown large, it has finer borders.
        let (width, height) = (400, 300);
        for (cx, cy) in [(200.0, 150.0), (396.0, 150.0), (150.0, 2.0)] {
            let image = frame(width, height, (cx, cy, 14.0));
            let bbox = BBox::from_ltwh(cx - 15.0, cy - 14.0, 30.0, 28.0);
            let found = segmented(&mut network, &image, &bbox);
            let (left, right) = ((cx - 30.0_f64).max(0.0), (cx + 30.0_f64).min(400.0));
            let (top, bottom) = ((cy - 28.0_f64).max(0.0), (cy + 28.0_f64).min(300.0));
            let window = [left, top, right - left, bottom - top].map(|v| v as i64);
            let wanted = twin(&image, &bbox, window);
            let within: Vec<usize> = (0..width * height)
                .filter(|k| {
                    (left..right).contains(&((k % width) as f64)) && (top..bottom).contains(&((k / width) as f64))
                })
                .collect();
            assert!(found.iter().enumerate().all(|(k, is)| !is || within.contains(&k)));
            let of = |k: &usize| (found[*k], wanted[*k]);
            let (found, wanted): (Vec<bool>, Vec<f64>) = within.iter().map(of).unzip();
            compare(&found, &wanted, &format!("{cx}, {cy}"));
        }
    }
}

#[test]
fn the_mask_that_is_said_to_be_best_is_taken() {
    let image = frame(64, 48, (36.0, 24.0, 14.0));
    let bbox = BBox::from_ltwh(21.0, 11.0, 30.0, 26.0);
    for way in ways() {
        let area = |qualities: [f32; 3]| {
            let folder = tempfile::tempdir().unwrap();
            let model = pair(folder.path(), &decoder(qualities));
            let mut network = SegmentationNetwork::open(&model, &way).unwrap();
            segmented(&mut network, &image, &bbox).iter().filter(|c| **c).count()
        };
        // The first mask is the box, the third what is not the target; not-a-number is no quality.
        let (whole, good, rest) = (area([0.9, 0.3, 0.5]), area([0.3, 0.9, 0.5]), area([0.3, 0.5, 0.9]));
        assert_eq!(whole, 30 * 26);
        assert!(good < whole && good > 300 && good + rest > 64 * 48 - 60, "{whole}, {good}, {rest}");
        assert_eq!(area([0.3, f32::NAN, 0.1]), whole);
        assert_eq!(area([f32::NAN, -0.5, -0.6]), good);
        assert_eq!(area([f32::NAN; 3]), 0);
    }
}
