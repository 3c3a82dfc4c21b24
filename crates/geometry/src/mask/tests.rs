#![allow(clippy::unwrap_used, reason = "a test may panic")]
use super::*;
use proptest::prelude::*;
use std::collections::BTreeSet;

/// The slow, obvious twin: a set of columns and rows.
type Pixels = BTreeSet<(u32, u32)>;

fn pixels(mask: &Mask) -> Pixels {
    mask.spans().iter().flat_map(|s| (s.from..s.to).map(|x| (x, s.row))).collect()
}

fn mask(size: Size, of: &Pixels) -> Mask {
    Mask::from_fn(size, |x, y| of.contains(&(x as u32, y as u32)))
}

fn is_canonical(mask: &Mask) -> bool {
    mask.spans().iter().all(|s| s.from < s.to)
        && mask.spans().windows(2).all(|w| w[0].row < w[1].row || (w[0].row == w[1].row && w[0].to < w[1].from))
}

prop_compose! {
    fn sized()(width in 1_usize..12, height in 1_usize..12)(
        size in Just(Size::new(width, height)),
        a in prop::collection::vec(any::<bool>(), width * height),
        b in prop::collection::vec(any::<bool>(), width * height),
    ) -> (Size, Mask, Mask) {
        let of = |bits: &[bool]| Mask::from_fn(size, |x, y| bits[y * size.width + x]);
        (size, of(&a), of(&b))
    }
}

proptest! {
    #[test]
    fn sets_and_runs_agree((size, a, b) in sized()) {
        let (pa, pb) = (pixels(&a), pixels(&b));
        prop_assert!(is_canonical(&a));
        prop_assert_eq!(a.area(), pa.len() as u64);
        prop_assert_eq!(a.common_area(&b), pa.intersection(&pb).count() as u64);
        let union = pa.union(&pb).count();
        let iou = if union == 0 { 1.0 } else { pa.intersection(&pb).count() as f64 / union as f64 };
        prop_assert_eq!(a.iou(&b), iou);
        prop_assert_eq!(&mask(size, &pa), &a);
        for x in 0..size.width as u32 + 1 {
            for y in 0..size.height as u32 + 1 {
                prop_assert_eq!(a.contains(x, y), pa.contains(&(x, y)));
            }
        }
        let edge = |&&(x, y): &&(u32, u32)| {
            let inside = |dx: i64, dy: i64| {
                let (x, y) = (i64::from(x) + dx, i64::from(y) + dy);
                x >= 0 && y >= 0 && pa.contains(&(x as u32, y as u32))
            };
            !(inside(-1, 0) && inside(1, 0) && inside(0, -1) && inside(0, 1))
        };
        let outline = a.outline();
        prop_assert!(is_canonical(&outline));
        prop_assert_eq!(pixels(&outline), pa.iter().filter(edge).copied().collect::<Pixels>());
    }

    #[test]
    fn formats_are_read_back((size, a, _) in sized()) {
        let back = Mask::from_vot(&a.to_vot()).unwrap();
        prop_assert!(is_canonical(&back));
        prop_assert_eq!(&back, &a);
        let counts = a.to_coco_counts(size).unwrap();
        prop_assert_eq!(counts.iter().sum::<u64>(), size.area() as u64);
        // Down the columns, pixel by pixel.
        let mut said = Vec::new();
        for (k, n) in counts.iter().enumerate() {
            said.extend(vec![k % 2 == 1; *n as usize]);
        }
        let slow: Vec<bool> =
            (0..size.width).flat_map(|x| (0..size.height).map(move |y| (x, y))).map(|(x, y)| a.contains(x as u32, y as u32)).collect();
        prop_assert_eq!(said, slow);
        prop_assert_eq!(&Mask::from_coco_counts(size, &counts).unwrap(), &a);
        let coco = a.to_coco(size).unwrap();
        let back = coco.mask().unwrap();
        prop_assert!(is_canonical(&back));
        prop_assert_eq!(&back, &a);
    }

    #[test]
    fn mapped_pixels_come_from_set_ones(
        (size, a, _) in sized(), sx in 0.3_f64..3.0, sy in 0.3_f64..3.0, tx in -8.0_f64..8.0, ty in -8.0_f64..8.0,
    ) {
        let to = Size::new(size.width + 5, size.height + 3);
        let mapped = a.mapped([sx, sy], [tx, ty], to);
        prop_assert!(is_canonical(&mapped));
        let slow = Mask::from_fn(to, |x, y| {
            let (x, y) = ((x as f64 + 0.5 - tx) / sx, (y as f64 + 0.5 - ty) / sy);
            x >= 0.0 && y >= 0.0 && a.contains(x as u32, y as u32)
        });
        prop_assert_eq!(mapped, slow);
    }

    #[test]
    fn any_text_is_a_mask_or_an_error(text in "m?[-0-9, ]{0,40}", counts in "[0-o]{0,24}", h in 0_u64..40, w in 0_u64..40) {
        if let Ok(mask) = Mask::from_vot(&text) {
            prop_assert!(is_canonical(&mask));
        }
        if let Ok(mask) = (CocoMask { size: [h, w], counts }).mask() {
            prop_assert!(is_canonical(&mask) && mask.clipped_to(Size::new(w as usize, h as usize)) == mask);
        }
    }
}

#[test]
fn vot_masks_of_the_toolkit_are_read() {
    // A plus of five pixels at column 3, row 2.
    let plus = Mask::from_vot("m2,1,3,3,1,1,1,3,1,1,1").unwrap();
    let wanted: Pixels = [(3, 1), (2, 2), (3, 2), (4, 2), (3, 3)].into();
    assert_eq!(pixels(&plus), wanted);
    assert_eq!(plus.bounds(), Some(BBox::from_ltwh(2.0, 1.0, 3.0, 3.0)));
    // The last unset pixels may be missing, runs may be cut by empty ones, and the rectangle may begin outside of the image.
    assert_eq!(Mask::from_vot("m 2,1,3,3,1,1,1,2,0,1,1,1").unwrap(), plus);
    let over = Mask::from_vot("m-1,-1,3,3,0,9").unwrap();
    assert_eq!(pixels(&over), [(0, 0), (1, 0), (0, 1), (1, 1)].into());
    assert_eq!(Mask::default().to_vot(), "m0,0,1,1,1");
    assert!(Mask::from_vot("m0,0,1,1,1").unwrap().is_empty());
}

#[test]
fn coco_strings_are_those_of_its_own_tools() {
    // The runs 6,1,40,4,5,4,5,4,21 of a 9x10 image make this string in the data set's reference code.
    let size = Size::new(10, 9);
    let mask = Mask::from_coco_counts(size, &[6, 1, 40, 4, 5, 4, 5, 4, 21]).unwrap();
    assert_eq!(mask.to_coco(size).unwrap(), CocoMask { size: [9, 10], counts: "61X13mN000`0".to_owned() });
    assert_eq!(mask.to_coco(size).unwrap().mask().unwrap(), mask);
    assert_eq!(Mask::default().to_coco_counts(size).unwrap(), [90]);
    let too_small = mask.to_coco(Size::new(7, 9)).unwrap_err();
    assert!(too_small.to_string().contains("over the border"), "{too_small}");
}

#[test]
fn hostile_text_is_refused() {
    for (text, said) in [
        ("0,0,1,1,1", "begin with `m`"),
        ("m", "whole number"),
        ("m1,2", "rectangle"),
        ("m0,0,-1,1", "below 0"),
        ("m0,0,2,2,1,-1", "below 0"),
        ("m0,0,2,2,1,4", "longer than"),
        ("m0,0,99999,99999,0,9999800001", "too large"),
        ("m0,0,9223372036854775807,9223372036854775807,1", "too large"),
        ("m9000000,0,2,2,0,4", "too far off"),
        ("m0,0,0,0,0,1", "longer than"),
        ("m0,0,1,1,9223372036854775807,9223372036854775807", "longer than"),
    ] {
        let error = Mask::from_vot(text).unwrap_err().to_string();
        assert!(error.contains(said), "{text}: {error}");
    }
    for (counts, said) in
        [("\u{7f}", "none of its own"), ("PPPPPPPPPPPPPPP", "too long"), ("P", "within a number"), ("O", "shorter")]
    {
        let error = (CocoMask { size: [4, 4], counts: counts.to_owned() }).mask().unwrap_err().to_string();
        assert!(error.contains(said), "{counts}: {error}");
    }
    assert!((CocoMask { size: [u64::MAX, 2], counts: String::new() }).mask().is_err());
    let long = "9".repeat(500);
    assert!(Mask::from_vot(&format!("m{long}")).unwrap_err().to_string().len() < 700);
}

#[test]
fn boxes_become_the_pixels_whose_centres_they_hold() {
    let size = Size::new(10, 8);
    let made = Mask::from_bbox(&BBox::from_ltrb(-3.0, 1.4, 3.6, 4.5), size);
    assert_eq!(made, Mask::from_fn(size, |x, y| x < 4 && (1..4).contains(&y)));
    assert!(Mask::from_bbox(&BBox::from_ltwh(f64::NAN, 0.0, 1.0, 1.0), size).is_empty());
    assert!(made.mapped([0.0, 1.0], [0.0, 0.0], size).is_empty());
}
