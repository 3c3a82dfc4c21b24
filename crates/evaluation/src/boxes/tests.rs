use super::*;
use pursuit_tracking::Class;

fn parsed(text: &str, format: BoxFormat) -> Result<Boxes> {
    parse_boxes(&mut text.as_bytes(), Path::new("boxes"), format, Some(Size::new(200, 100)))
}

/// Frame, id, left, top, width, height, score, class.
type Plain<'a> = (u64, Option<u64>, [f64; 4], f64, Option<&'a str>);

fn plain(boxes: &Boxes) -> Vec<Plain<'_>> {
    let row = |r: &'_ BoxRow| (r.frame, r.id, r.bbox.ltwh(), r.score);
    let rows = boxes.rows().iter();
    rows.map(|r| {
        let (frame, id, (l, t, w, h), score) = row(r);
        (frame, id, [l, t, w, h], score, r.class.as_ref().map(Class::as_str))
    })
    .collect()
}

#[test]
fn every_form_says_the_same_boxes() {
    let cases = [
        (BoxFormat::Mot, "2,-1,11,21,30,40,0.5,3,1\n1,7,2,3,4,5,1,3,1\n"),
        (
            BoxFormat::Kitti,
            "1 -1 3 0 0 0 10 20 40 60 0 0 0 0 0 0 0 0.5\n0 7 3 0 0 0 1 2 5 7\n0 -1 DontCare -1 -1 -10 0 0 9 9\n",
        ),
        (
            BoxFormat::Coco,
            r#"[{"image_id":2,"bbox":[10,20,30,40],"score":0.5,"category_id":3},{"image_id":1,"bbox":[1,2,4,5],"track_id":7,"category_id":3}]"#,
        ),
        (
            BoxFormat::Jsonl,
            "{\"frame\":1,\"box\":[10,20,30,40],\"score\":0.5,\"class\":3}\n{\"frame\":0,\"target\":7,\"box\":[1,2,4,5],\"class\":\"3\"}\n{\"frame\":2,\"box\":null}\n",
        ),
    ];
    for (format, text) in cases {
        let boxes = parsed(text, format).unwrap().in_pixels();
        let wanted = vec![
            (0, Some(7), [1.0, 2.0, 4.0, 5.0], 1.0, Some("3")),
            (1, None, [10.0, 20.0, 30.0, 40.0], 0.5, Some("3")),
        ];
        assert_eq!(plain(&boxes), wanted, "{format}");
        assert_eq!((boxes.frames(), boxes.of(1).len(), boxes.of(5).len()), (2, 1, 0));
    }
}

#[test]
fn a_folder_of_yolo_is_a_sequence() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("clip_10.txt"), "0 0.5 0.5 0.1 0.2 0.75 4\n").unwrap();
    std::fs::write(folder.path().join("clip_1.txt"), "2 0.25 0.5 0.1 0.2\n").unwrap();
    let boxes = read_boxes(folder.path(), None, Some(Size::new(200, 100))).unwrap();
    assert_eq!(
        plain(&boxes),
        [(0, None, [40.0, 40.0, 20.0, 20.0], 1.0, Some("2")), (9, Some(4), [90.0, 40.0, 20.0, 20.0], 0.75, Some("0"))]
    );
    let without = read_boxes(folder.path(), None, None).unwrap_err().to_string();
    assert!(without.contains("--size"), "{without}");
    std::fs::write(folder.path().join("readme.txt"), "").unwrap();
    assert!(read_boxes(folder.path(), None, Some(Size::new(2, 2))).unwrap_err().to_string().contains("readme.txt"));
}

#[test]
fn forms_are_told_apart_by_name_and_first_line() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text, form) in [
        ("a.txt", "1,-1,1,1,2,2,1\n", BoxFormat::Mot),
        ("b.txt", "0 1 Car 0 0 0 1 1 2 2 0 0 0 0 0 0 0 0.5\n", BoxFormat::Kitti),
        ("c.json", "[]", BoxFormat::Coco),
        ("d.jsonl", "", BoxFormat::Jsonl),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        assert_eq!(BoxFormat::of(&path).unwrap(), form);
        assert_eq!(form.name().parse::<BoxFormat>().unwrap(), form);
    }
    assert!("xml".parse::<BoxFormat>().unwrap_err().to_string().contains("jsonl"));
}

#[test]
fn damaged_lines_are_named_with_their_mend() {
    for (format, text, words) in [
        (BoxFormat::Mot, "1,-1,1,1,2,2,1\n1,-1,1,1\n", &["boxes:2", "4 cells", "height"][..]),
        (BoxFormat::Mot, "0,-1,1,1,2,2,1\n", &["boxes:1", "frame 0", "1 or more"]),
        (BoxFormat::Mot, "1.5,-1,1,1,2,2,1\n", &["frame 1.5"]),
        (BoxFormat::Mot, "1,-1,nan,1,2,2,1\n", &["boxes:1", "NaN"]),
        (BoxFormat::Mot, "1,-1,1,1,-2,2,1\n", &["not below 0"]),
        (BoxFormat::Mot, "1,-1,1,1,1e300,2,1\n", &["cannot be one"]),
        (BoxFormat::Mot, "1,-1,1,1,2,2,inf\n", &["score"]),
        (BoxFormat::Mot, "99999999999,-1,1,1,2,2,1\n", &["frame", "above"]),
        (BoxFormat::Mot, "frame,id,x\n", &["boxes:1", "3 cells"]),
        (BoxFormat::Kitti, "0 1 Car 0 0\n", &["5 cells", "right bottom"]),
        (BoxFormat::Yolo, "0 0.5 0.5 wide 0.2\n", &["w `wide`"]),
        (BoxFormat::Yolo, "0 0.5 0.5\n", &["3 cells"]),
        (BoxFormat::Coco, "[{\"image_id\":1,\"bbox\":[1,2,3]}]", &["COCO", "image_id"]),
        (BoxFormat::Coco, r#"{"images":[{"id":1}],"annotations":[{"image_id":2,"bbox":[1,2,3,4]}]}"#, &["image 2"]),
        (BoxFormat::Jsonl, "{\"frame\":-1}\n", &["boxes:1", "\"box\""]),
        (BoxFormat::Jsonl, "{\"frame\":0,\"box\":[1,2,-3,4]}\n", &["boxes:1", "not below 0"]),
    ] {
        let message = parsed(text, format).unwrap_err().to_string();
        for word in words {
            assert!(message.contains(word), "{format} {text:?}: {message}");
        }
    }
    let bytes = [0xff, 0xfe, b'\n'];
    let message = parse_boxes(&mut &bytes[..], Path::new("b"), BoxFormat::Mot, None).unwrap_err().to_string();
    assert!(message.contains("no text"), "{message}");
}
