//! What OpenCV's `FileStorage` writes after a calibration: YAML with tags that no YAML library knows, or JSON. Of YAML only the
//! part that it writes is read: plain keys, matrices with their `data` between brackets.

use super::Camera;
use crate::{MeasuringError, Result};
use std::collections::BTreeMap;

/// A camera file has a few hundred numbers at most; what is larger is something else.
const MOST_BYTES: usize = 1 << 20;
const MATRIX: [&str; 6] = ["camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1", "intrinsic_matrix"];
const DISTORTION: [&str; 8] = [
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distCoeffs",
    "dist_coeffs",
    "dist_coeff",
    "dist",
    "D",
    "D1",
];
const WIDTH: [&str; 3] = ["image_width", "image_Width", "width"];
const HEIGHT: [&str; 3] = ["image_height", "image_Height", "height"];
const SIZE: [&str; 2] = ["image_size", "imageSize"];

/// Numbers by the key that they stand under.
type Numbers = BTreeMap<String, Vec<f64>>;

pub(super) fn read(text: &str) -> Result<Camera> {
    if text.len() > MOST_BYTES {
        return Err(MeasuringError::Camera(
            "the camera file is larger than a megabyte, which no calibration is; name the file that OpenCV wrote"
                .into(),
        ));
    }
    let json = text.trim_start().starts_with('{');
    let numbers = if json { from_json(text)? } else { from_yaml(text) };
    let find = |names: &[&str]| names.iter().find_map(|name| numbers.get(*name));
    let missing = |what: &str, names: &[&str]| {
        MeasuringError::Camera(format!(
            "the camera file says nothing of {what}; it stands under {} in what OpenCV writes",
            names.join(", ")
        ))
    };
    let matrix = find(&MATRIX).filter(|m| m.len() == 9).ok_or_else(|| missing("the camera's 3x3 matrix", &MATRIX))?;
    let [fx, skew, cx, _, fy, cy] = matrix[..6] else { return Err(missing("the camera's 3x3 matrix", &MATRIX)) };
    if skew.abs() > 1e-6 * fx.abs() {
        return Err(MeasuringError::Camera(format!(
            "the camera's matrix has a skew of {skew}; only cameras without skew are understood, calibrate without it"
        )));
    }
    let one = |names: &[&str]| find(names).and_then(|n| n.first()).copied();
    let size = match (one(&WIDTH), one(&HEIGHT), find(&SIZE).map(Vec::as_slice)) {
        (Some(width), Some(height), _) | (_, _, Some(&[width, height])) => [width, height],
        _ => return Err(missing("the size of its pictures", &["image_width and image_height"])),
    };
    if !size.iter().all(|side| (1.0..=1e6).contains(side)) {
        return Err(missing("a sensible size of its pictures", &["image_width and image_height"]));
    }
    Ok(Camera {
        picture: size.map(|side| side as usize),
        focal: [fx, fy],
        centre: [cx + 0.5, cy + 0.5],
        distortion: find(&DISTORTION).cloned().unwrap_or_default(),
    })
}

fn from_json(text: &str) -> Result<Numbers> {
    let value: serde_json::Value = serde_json::from_str(text).map_err(|e| {
        MeasuringError::Camera(format!("the camera file is no JSON: {e}; name the file that OpenCV wrote"))
    })?;
    let entries = value.as_object().into_iter().flatten();
    Ok(entries.map(|(key, value)| (key.clone(), flattened(value.get("data").unwrap_or(value)))).collect())
}

/// The numbers of a list, of a list of lists, or the number itself.
fn flattened(value: &serde_json::Value) -> Vec<f64> {
    match value {
        serde_json::Value::Array(items) => items.iter().flat_map(flattened).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

/// Key by key: a number behind the key, numbers between brackets (over several lines), or a matrix whose `data` follow on
/// indented lines.
fn from_yaml(text: &str) -> Numbers {
    let mut numbers = Numbers::new();
    let (mut owner, mut open) = (String::new(), None::<String>);
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default();
        if let Some(key) = &open {
            numbers.entry(key.clone()).or_default().extend(listed(line));
            if line.contains(']') {
                open = None;
            }
            continue;
        }
        let Some((key, rest)) = line.split_once(':') else { continue };
        let indented = key.starts_with([' ', '\t']);
        let (key, rest) = (key.trim().trim_matches('"'), rest.trim());
        if !indented {
            owner = key.to_owned();
        }
        let name = match (indented, key) {
            (false, _) => key.to_owned(),
            (true, "data") => owner.clone(),
            (true, _) => format!("{owner}.{key}"),
        };
        if let Some((_, list)) = rest.split_once('[') {
            numbers.insert(name.clone(), listed(list));
            if !list.contains(']') {
                open = Some(name);
            }
        } else if let Ok(number) = rest.parse() {
            numbers.insert(name, vec![number]);
        }
    }
    numbers
}

fn listed(text: &str) -> Vec<f64> {
    text.split(']').next().unwrap_or_default().split([',', '[']).filter_map(|n| n.trim().parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Camera;

    const YAML: &str = "%YAML:1.0\n---\ncalibration_time: \"Tue 3 Feb\"\nimage_width: 1280\nimage_height: 720\n\
        camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 9.0e+02, 0., 640., 0.,\n       910., 355.5,\n       0., 0., 1. ]\n\
        distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ -2.1e-01, 0.05, 0.001, -0.0007, -0.004 ]\n\
        avg_reprojection_error: 2.5e-01\n";

    #[test]
    fn yaml_and_json_of_opencv_are_read() {
        let yaml = Camera::from_opencv(YAML).unwrap();
        assert_eq!((yaml.picture, yaml.focal, yaml.centre), ([1280, 720], [900.0, 910.0], [640.5, 356.0]));
        assert_eq!(yaml.distortion, [-0.21, 0.05, 0.001, -0.0007, -0.004]);
        let json = r#"{"image_width": 1280, "image_height": 720,
            "camera_matrix": {"type_id": "opencv-matrix", "rows": 3, "cols": 3, "dt": "d",
                "data": [900.0, 0.0, 640.0, 0.0, 910.0, 355.5, 0.0, 0.0, 1.0]},
            "distortion_coefficients": [[-0.21, 0.05, 0.001, -0.0007, -0.004]]}"#;
        assert_eq!(Camera::from_opencv(json).unwrap(), yaml);
    }

    #[test]
    fn what_is_missing_is_named() {
        for (text, words) in [
            ("", "camera_matrix"),
            ("{", "no JSON"),
            ("camera_matrix: [1, 0, 2, 0, 1, 2, 0, 0, 1]", "image_width"),
            ("image_width: 5\nimage_height: 5\ncamera_matrix: [1, 2, 3]", "3x3"),
            ("image_width: 5\nimage_height: 5\ncamera_matrix: [1, 0.5, 2, 0, 1, 2, 0, 0, 1]", "skew"),
            ("image_width: 0\nimage_height: 5\ncamera_matrix: [1, 0, 2, 0, 1, 2, 0, 0, 1]", "size"),
        ] {
            let message = Camera::from_opencv(text).unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
        let longer = YAML.replace("-0.0007, -0.004", "-0.0007, -0.004, 1, 2");
        assert!(Camera::from_opencv(&longer).unwrap_err().to_string().contains("7 distortion coefficients"));
    }
}
