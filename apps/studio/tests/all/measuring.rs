//! Measuring through the calls of the page.

use crate::common::{Opened, studio};
use serde_json::{Value, json};

/// A ball that is thrown at 200 pixels a metre, seen 240 times a second and played at 30.
const THROW: &str = "scene:motion?motion=throw&fps=240&gravity=1962&duration=1&width=960&height=540&speed=400";

fn stick(length: &str) -> Value {
    json!({
        "picture": [960, 540],
        "stick": { "from": [40.0, 500.0], "to": [440.0, 500.0], "length": length },
        "axes": { "origin": [40.0, 500.0] },
    })
}

fn measurement(studio: &Opened, trial: &str) -> Value {
    let answer = studio.get(&format!("{trial}/measurement"));
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.json()
}

#[test]
fn a_throw_is_measured_in_metres_and_taken_away_as_files() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": THROW, "tracker": "mosse" }));
    let before = measurement(&studio, &trial);
    assert!(before["problem"].as_str().unwrap().contains("drag a box"), "{before}");
    studio.follow_to_the_end(&trial);
    // Without a ruler in pixels.
    let pixels = measurement(&studio, &trial);
    assert_eq!((&pixels["unit"], &pixels["ruler"]["kind"]), (&json!("px"), &json!("pixels")));
    let setting = json!({ "calibration": stick("2m"), "options": { "fits": ["parabola"] } });
    let told = studio.ok("PUT", &format!("{trial}/measuring"), &setting);
    assert_eq!((&told["problem"], &told["ruler"]["kind"]), (&Value::Null, &json!("stick")));
    assert!((told["ruler"]["per_pixel"].as_f64().unwrap() - 0.005).abs() < 1e-9, "{told}");
    let found = measurement(&studio, &trial);
    assert_eq!((&found["unit"], &found["problem"]), (&json!("m"), &Value::Null));
    let parameters = found["fits"][0]["parameters"].as_array().unwrap();
    let g = parameters.iter().find(|p| p["name"] == "acceleration").unwrap();
    let (value, error) = (g["value"].as_f64().unwrap(), g["error"].as_f64().unwrap());
    assert!((value - 9.81).abs() < (3.0 * error).min(0.1), "{value} ± {error}");
    // What is drawn in the picture is where the target was measured, and its arrow leads along its path.
    let own = &found["targets"][0];
    let seen: Vec<Vec<f64>> = serde_json::from_value(own["seen"].clone()).unwrap();
    let (at, next) = (&seen[40], &seen[41]);
    let step = [next[0] - at[0], next[1] - at[1]];
    for axis in 0..2 {
        assert!((at[2 + axis] / 240.0 - step[axis]).abs() < 0.2, "{at:?} {step:?}");
    }
    // The files are the command's.
    let csv = studio.get(&format!("{trial}/measurement/file"));
    assert!(csv.text().starts_with("frame,time_s,target,how,x_m,x_sd_m,y_m"), "{}", csv.text());
    assert_eq!(csv.text().lines().count(), 1 + own["frame"].as_array().unwrap().len());
    let json = studio.get(&format!("{trial}/measurement/file?format=json")).json();
    assert_eq!(json["fits"][0]["parameters"], found["fits"][0]["parameters"]);
    assert!(studio.get(&format!("{trial}/measurement/file?format=events")).text().starts_with("target,event,"));
    let book = studio.get(&format!("{trial}/measurement/file?format=xlsx"));
    if told["spreadsheets"] == true {
        assert_eq!(&book.body[..2], b"PK");
    } else {
        assert!(book.status == 422 && book.text().contains("--features xlsx"), "{}", book.text());
    }
    assert_eq!(studio.get(&format!("{trial}/measurement/file?format=doc")).status, 400);
}

#[test]
fn what_cannot_be_meant_is_told_with_its_mend() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:drift?duration=1", "tracker": "mosse" }));
    let at = format!("{trial}/measuring");
    let points = |p: &[[f64; 4]]| json!({ "plane": { "unit": "m", "points": p } });
    let line = [[0.0, 0.0, 0.0, 0.0], [10.0, 10.0, 1.0, 0.0], [20.0, 20.0, 1.0, 1.0], [30.0, 30.0, 0.0, 1.0]];
    for (calibration, words) in [
        (json!({ "stick": { "from": [9.0, 9.0], "to": [9.0, 9.0], "length": "1m" } }), "click its two ends"),
        (points(&line), "lie on a line"),
        (points(&line[..3]), "click at least 4"),
        (json!({ "true_fps": -3.0 }), "true_fps"),
    ] {
        let told = studio.ok("PUT", &at, &json!({ "calibration": calibration }));
        assert!(told["problem"].as_str().unwrap().contains(words), "{told}");
        assert!(measurement(&studio, &trial)["problem"].is_string());
        let kept = studio.send("POST", &format!("{at}/calibration"), &json!({}));
        assert!(kept.status == 422 && kept.text().contains(words), "{}", kept.text());
    }
    let other_size = json!({ "calibration": { "picture": [9, 9], "stick": stick("1m")["stick"] } });
    studio.ok("PUT", &at, &other_size);
    studio.follow_to_the_end(&trial);
    let refused = measurement(&studio, &trial);
    assert!(refused["problem"].as_str().unwrap().contains("made on pictures of 9x9"), "{refused}");
    for (setting, words) in [
        (json!({ "calibration": stick("3 ell") }), "no unit `ell`"),
        (json!({ "calibration": stick("0m") }), "not a length"),
        (json!({ "calibration": { "stik": 1 } }), "unknown field `stik`"),
        (json!({ "options": { "calibration": "/etc/passwd" } }), ""),
    ] {
        let answer = studio.send("PUT", &at, &setting);
        let said = if answer.status == 200 { answer.json()["problem"].to_string() } else { answer.text() };
        assert!(matches!(answer.status, 200 | 422) && said.contains(words) && said != "null", "{said}");
    }
    let measured = measurement(&studio, &trial);
    assert!(measured["problem"].as_str().unwrap().contains("leave them out"), "{measured}");
    let camera =
        |text: &str| studio.request("POST", "/api/cameras", &[("Content-Type", "text/plain")], text.as_bytes());
    let good = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [500., 0., 319.5, 0., 500., 239.5, 0., 0., 1.]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n   data: [-0.1, 0., 0., 0.]\n";
    assert_eq!(camera(good).json()["centre"], json!([320.0, 240.0]));
    assert_eq!(camera("nothing: of a camera").status, 422);
}

#[test]
fn a_click_is_put_on_the_corner_that_it_meant() {
    let (studio, root) = studio();
    // A crossing at (40, 30), edges only elsewhere.
    let pixels: Vec<u8> =
        (0..60_u32).flat_map(|y| (0..80_u32).map(move |x| if (x < 40) == (y < 30) { 220 } else { 40 })).collect();
    let header = b"YUV4MPEG2 W80 H60 F25:1 Ip A1:1 Cmono\nFRAME\n".to_vec();
    let frame = [b"FRAME\n".to_vec(), pixels.clone()].concat();
    std::fs::write(root.path().join("board.y4m"), [header, pixels, frame].concat()).unwrap();
    let trial = studio.trial(&json!({ "source": "board.y4m", "tracker": "mosse" }));
    let corner = |x: f64, y: f64| studio.get(&format!("{trial}/corner?x={x}&y={y}&radius=6")).json();
    let found = corner(42.0, 28.6);
    let off = (found["x"].as_f64().unwrap() - 40.0).hypot(found["y"].as_f64().unwrap() - 30.0);
    assert!(found["kind"] == "corner" && off < 0.1, "{found}");
    let edge = corner(41.5, 10.0);
    assert!(edge["kind"] == "edge" && (edge["x"].as_f64().unwrap() - 40.0).abs() < 0.1, "{edge}");
    assert!((edge["y"].as_f64().unwrap() - 10.0).abs() < 0.01, "{edge}");
    let flat = corner(20.0, 12.0);
    assert_eq!((&flat["kind"], &flat["x"]), (&json!("none"), &json!(20.0)));
}

#[test]
fn a_calibration_is_kept_beside_its_clip_and_read_again() {
    let (studio, root) = studio();
    std::fs::create_dir(root.path().join("clips")).unwrap();
    let frame = [b"FRAME\n".to_vec(), vec![90; 64 * 48]].concat();
    let clip = [b"YUV4MPEG2 W64 H48 F25:1 Ip A1:1 Cmono\n".to_vec(), frame.clone(), frame].concat();
    std::fs::write(root.path().join("clips/a.y4m"), &clip).unwrap();
    let open = || studio.trial(&json!({ "source": "clips/a.y4m", "tracker": "mosse" }));
    let trial = open();
    let calibration =
        json!({ "picture": [64, 48], "stick": { "from": [4.0, 4.0], "to": [44.0, 4.0], "length": "0.5m+-1mm" } });
    let setting = json!({ "calibration": calibration });
    let told = studio.ok("PUT", &format!("{trial}/measuring"), &setting);
    assert_eq!((&told["file"]["place"], &told["file"]["read"]), (&json!("clips/calibration.toml"), &Value::Null));
    let at = format!("{trial}/measuring/calibration");
    assert_eq!(studio.ok("POST", &at, &json!({}))["file"]["read"], "clips/calibration.toml");
    let file = root.path().join("clips/calibration.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    assert_eq!(studio.get(&at).text(), text);
    // One that is there is not replaced unasked.
    let other = json!({ "calibration": { "picture": [64, 48], "true_fps": 240.0 } });
    studio.ok("PUT", &format!("{trial}/measuring"), &other);
    let refused = studio.send("POST", &at, &json!({}));
    assert!(refused.status == 409 && refused.text().contains("replaced"), "{}", refused.text());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
    // Another trial of the same clip begins with it.
    let again = studio.get(&format!("{}/measuring", open())).json();
    assert_eq!(again["calibration"]["stick"]["length"], told["calibration"]["stick"]["length"]);
    assert_eq!(again["file"]["read"], "clips/calibration.toml");
    studio.ok("POST", &at, &json!({ "overwrite": true }));
    assert!(std::fs::read_to_string(&file).unwrap().contains("240"));
    // What lies there and is none is said, and what is no file of its own is left alone.
    std::fs::write(&file, "stick = 3").unwrap();
    let warned = studio.get(&format!("{}/measuring", open())).json();
    let warning = warned["file"]["warning"].as_str().unwrap();
    assert!(
        warning.contains("clips/calibration.toml") && !warning.contains(root.path().to_str().unwrap()),
        "{warning}"
    );
    #[cfg(unix)]
    {
        let secret = root.path().join("secret");
        std::fs::write(&secret, "kept").unwrap();
        std::fs::remove_file(&file).unwrap();
        std::os::unix::fs::symlink(&secret, &file).unwrap();
        let part = root.path().join("clips/calibration.toml.part");
        let through = studio.send("POST", &at, &json!({ "overwrite": true }));
        assert_eq!(through.status, 409, "{}", through.text());
        std::fs::remove_file(&file).unwrap();
        std::os::unix::fs::symlink(&secret, &part).unwrap();
        studio.ok("POST", &at, &json!({ "overwrite": true }));
        assert_eq!(std::fs::read_to_string(&secret).unwrap(), "kept");
    }
    // A scene has no folder.
    let scene = studio.trial(&json!({ "source": "scene:drift?duration=1", "tracker": "mosse" }));
    let nowhere = studio.send("POST", &format!("{scene}/measuring/calibration"), &json!({}));
    assert!(nowhere.status == 422 && nowhere.text().contains("download"), "{}", nowhere.text());
}
