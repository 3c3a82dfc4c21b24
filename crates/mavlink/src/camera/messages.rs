//! What a camera says.

use super::schedule::{GEO_STATUS, IMAGE_STATUS, LANDING_TARGET};
use super::{CameraFacts, Shared, State, Tracking};
use crate::ground::{GroundPoint, ground_point};
use crate::rotation::Rotation;
use mavlink::dialects::common::{
    CAMERA_CAPTURE_STATUS_DATA, CAMERA_FOV_STATUS_DATA, CAMERA_INFORMATION_DATA, CAMERA_SETTINGS_DATA,
    CAMERA_TRACKING_GEO_STATUS_DATA, CAMERA_TRACKING_IMAGE_STATUS_DATA, CameraCapFlags, CameraMode, CameraTrackingMode,
    CameraTrackingStatusFlags, CameraTrackingTargetData, LANDING_TARGET_DATA, LandingTargetType, MavBool, MavFrame,
    MavMessage, STORAGE_INFORMATION_DATA, StorageStatus, VIDEO_STREAM_INFORMATION_DATA, VIDEO_STREAM_STATUS_DATA,
    VideoStreamStatusFlags, VideoStreamType,
};
use mavlink::types::CharArray;
use std::time::{Duration, Instant};

/// Of a picture that old nothing is true any more.
const STALE: Duration = Duration::from_secs(1);

/// Sends what is to be said of tracking, as far as it is its turn.
pub(super) fn send_tracking(shared: &Shared, state: &mut State, now: Instant) {
    let is_idle = state.tracking == Tracking::Idle;
    for id in [IMAGE_STATUS, GEO_STATUS, LANDING_TARGET] {
        // While nothing is tracked only whoever asks for that is told so.
        if state.schedule.is_due(id, now)
            && let Some(message) = message(shared, state, id, now)
            && !(is_idle && id == LANDING_TARGET)
        {
            shared.endpoint.send(&message);
        }
    }
}

/// A message by its number; `None` where this camera has no such thing to say.
pub(super) fn message(shared: &Shared, state: &State, id: u32, now: Instant) -> Option<MavMessage> {
    let (facts, time_boot_ms) = (&shared.facts, shared.endpoint.time_boot_ms());
    Some(match id {
        259 => MavMessage::CAMERA_INFORMATION(information(facts, time_boot_ms)),
        260 => MavMessage::CAMERA_SETTINGS(CAMERA_SETTINGS_DATA {
            time_boot_ms,
            mode_id: CameraMode::CAMERA_MODE_VIDEO,
            zoomLevel: f32::NAN,
            focusLevel: f32::NAN,
            camera_device_id: 0,
        }),
        261 => MavMessage::STORAGE_INFORMATION(STORAGE_INFORMATION_DATA {
            time_boot_ms,
            status: StorageStatus::STORAGE_STATUS_NOT_SUPPORTED,
            ..STORAGE_INFORMATION_DATA::default()
        }),
        262 => MavMessage::CAMERA_CAPTURE_STATUS(CAMERA_CAPTURE_STATUS_DATA {
            time_boot_ms,
            ..CAMERA_CAPTURE_STATUS_DATA::default()
        }),
        269 => MavMessage::VIDEO_STREAM_INFORMATION(stream_information(facts)?),
        270 => MavMessage::VIDEO_STREAM_STATUS(stream_status(facts)?),
        271 => MavMessage::CAMERA_FOV_STATUS(field_of_view(shared, state, now)),
        IMAGE_STATUS => MavMessage::CAMERA_TRACKING_IMAGE_STATUS(image_status(facts, state, now)),
        GEO_STATUS => MavMessage::CAMERA_TRACKING_GEO_STATUS(geo_status(shared, state, now)?),
        LANDING_TARGET => MavMessage::LANDING_TARGET(landing_target(facts, state, now)?),
        _ => return None,
    })
}

fn information(facts: &CameraFacts, time_boot_ms: u32) -> CAMERA_INFORMATION_DATA {
    let mut flags =
        CameraCapFlags::CAMERA_CAP_FLAGS_HAS_TRACKING_POINT | CameraCapFlags::CAMERA_CAP_FLAGS_HAS_TRACKING_RECTANGLE;
    flags.set(CameraCapFlags::CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM, facts.stream.is_some());
    flags.set(CameraCapFlags::CAMERA_CAP_FLAGS_HAS_TRACKING_GEO_STATUS, facts.field_of_view_deg.is_some());
    // Of a lens only its angle is known: the focal length that goes with a sensor as wide as 36 mm, as photographers count.
    let across = facts.tangents().map(|(across, _)| across);
    let sensor = |part: f64| if across.is_some() { (36.0 * part) as f32 } else { f32::NAN };
    let version = |text: &str| text.parse::<u32>().unwrap_or(0) & 0xFF;
    let [major, minor, patch] =
        [env!("CARGO_PKG_VERSION_MAJOR"), env!("CARGO_PKG_VERSION_MINOR"), env!("CARGO_PKG_VERSION_PATCH")]
            .map(version);
    CAMERA_INFORMATION_DATA {
        time_boot_ms,
        firmware_version: patch << 16 | minor << 8 | major,
        focal_length: across.map_or(f32::NAN, |across| (18.0 / across) as f32),
        sensor_size_h: sensor(1.0),
        sensor_size_v: sensor(f64::from(facts.size.1) / f64::from(facts.size.0.max(1))),
        flags,
        resolution_h: facts.size.0,
        resolution_v: facts.size.1,
        cam_definition_version: 0,
        vendor_name: fixed(&facts.vendor),
        model_name: fixed(&facts.model),
        lens_id: 0,
        cam_definition_uri: CharArray::new([0; 140]),
        gimbal_device_id: facts.gimbal_device,
        camera_device_id: 0,
    }
}

/// As much of a text as fits, with a zero behind it.
fn fixed<const N: usize>(text: &str) -> [u8; N] {
    let mut bytes = [0; N];
    let mut end = text.len().min(N.saturating_sub(1));
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    for (byte, of_text) in bytes.iter_mut().zip(text.as_bytes().iter().take(end)) {
        *byte = *of_text;
    }
    bytes
}

fn stream_information(facts: &CameraFacts) -> Option<VIDEO_STREAM_INFORMATION_DATA> {
    let stream = facts.stream.as_ref()?;
    let status = stream_status(facts)?;
    Some(VIDEO_STREAM_INFORMATION_DATA {
        framerate: status.framerate,
        flags: status.flags,
        resolution_h: status.resolution_h,
        resolution_v: status.resolution_v,
        hfov: status.hfov,
        stream_id: 1,
        count: 1,
        mavtype: VideoStreamType::VIDEO_STREAM_TYPE_RTSP,
        name: CharArray::new(fixed(&facts.model)),
        uri: CharArray::new(fixed(&stream.uri)),
        ..VIDEO_STREAM_INFORMATION_DATA::default()
    })
}

fn stream_status(facts: &CameraFacts) -> Option<VIDEO_STREAM_STATUS_DATA> {
    facts.stream.as_ref()?;
    Some(VIDEO_STREAM_STATUS_DATA {
        framerate: facts.fps.unwrap_or(0.0) as f32,
        flags: VideoStreamStatusFlags::VIDEO_STREAM_STATUS_FLAGS_RUNNING,
        resolution_h: facts.size.0,
        resolution_v: facts.size.1,
        hfov: facts.field_of_view_deg.unwrap_or(0.0).round() as u16,
        stream_id: 1,
        ..VIDEO_STREAM_STATUS_DATA::default()
    })
}

/// How the camera is turned in the world, where that is known: by the gimbal, else as it is fixed to the vehicle.
fn orientation(shared: &Shared, state: &State, now: Instant) -> Option<Rotation> {
    if let Some(turned) = state.turned {
        let angles = [0.0, turned.pitch_deg, turned.yaw_deg].map(f64::to_radians);
        return Some(Rotation::from_euler(angles[0], angles[1], angles[2]));
    }
    let mount = Rotation::from_euler(0.0, shared.facts.pitch_deg.to_radians(), 0.0);
    state.vehicle.stand(now).map(|stand| stand.rotation.after(mount))
}

fn field_of_view(shared: &Shared, state: &State, now: Instant) -> CAMERA_FOV_STATUS_DATA {
    let (position, orientation) = (state.vehicle.position(now), orientation(shared, state, now));
    let image = position.zip(orientation).map(|(from, camera)| ground_point(&from, camera, 0.0, 0.0));
    // A middle that does not meet the ground lies at infinity.
    let of_image = |of: fn(&GroundPoint) -> f64, scale: f64| match &image {
        None => i32::MAX,
        Some(None) => i32::MIN,
        Some(Some(point)) => (of(point) * scale).round() as i32,
    };
    CAMERA_FOV_STATUS_DATA {
        time_boot_ms: shared.endpoint.time_boot_ms(),
        lat_camera: position.map_or(i32::MAX, |p| (p.latitude_deg * 1e7).round() as i32),
        lon_camera: position.map_or(i32::MAX, |p| (p.longitude_deg * 1e7).round() as i32),
        alt_camera: position.map_or(i32::MAX, |p| (p.altitude_m * 1e3).round() as i32),
        lat_image: of_image(|p| p.latitude_deg, 1e7),
        lon_image: of_image(|p| p.longitude_deg, 1e7),
        alt_image: of_image(|p| p.altitude_m, 1e3),
        q: orientation.map_or([f32::NAN; 4], Rotation::quaternion),
        hfov: shared.facts.field_of_view_deg.map_or(f32::NAN, |deg| deg as f32),
        vfov: shared.facts.vertical_deg().map_or(f32::NAN, |deg| deg as f32),
        camera_device_id: 0,
    }
}

/// What holds now: what was said of an old picture does not.
fn current(state: &State, now: Instant) -> Tracking {
    let is_fresh = state.told.is_some_and(|told| now.saturating_duration_since(told) < STALE);
    if is_fresh || state.tracking == Tracking::Idle { state.tracking } else { Tracking::Lost }
}

fn flags(tracking: &Tracking) -> CameraTrackingStatusFlags {
    let active = CameraTrackingStatusFlags::CAMERA_TRACKING_STATUS_FLAGS_ACTIVE;
    match tracking {
        Tracking::Idle => CameraTrackingStatusFlags::empty(),
        Tracking::Seen(_) => active,
        Tracking::Coasting(_) => active | CameraTrackingStatusFlags::CAMERA_TRACKING_STATUS_FLAGS_COASTING,
        Tracking::Lost => CameraTrackingStatusFlags::CAMERA_TRACKING_STATUS_FLAGS_ERROR,
    }
}

fn image_status(facts: &CameraFacts, state: &State, now: Instant) -> CAMERA_TRACKING_IMAGE_STATUS_DATA {
    let tracking = current(state, now);
    let place = tracking.place();
    let number = |of: f64| of as f32;
    let aspect = f64::from(facts.size.1) / f64::from(facts.size.0.max(1));
    let radius = place.map(|p| 0.5 * (p.right - p.left).max((p.bottom - p.top) * aspect));
    CAMERA_TRACKING_IMAGE_STATUS_DATA {
        point_x: place.map_or(f32::NAN, |p| number(p.center().0)),
        point_y: place.map_or(f32::NAN, |p| number(p.center().1)),
        radius: radius.map_or(f32::NAN, number),
        rec_top_x: place.map_or(f32::NAN, |p| number(p.left)),
        rec_top_y: place.map_or(f32::NAN, |p| number(p.top)),
        rec_bottom_x: place.map_or(f32::NAN, |p| number(p.right)),
        rec_bottom_y: place.map_or(f32::NAN, |p| number(p.bottom)),
        tracking_status: flags(&tracking),
        tracking_mode: match tracking {
            Tracking::Idle => CameraTrackingMode::CAMERA_TRACKING_MODE_NONE,
            _ if state.requests.by_point => CameraTrackingMode::CAMERA_TRACKING_MODE_POINT,
            _ => CameraTrackingMode::CAMERA_TRACKING_MODE_RECTANGLE,
        },
        target_data: match place {
            Some(_) => CameraTrackingTargetData::CAMERA_TRACKING_TARGET_DATA_IN_STATUS,
            None => CameraTrackingTargetData::empty(),
        },
        camera_device_id: 0,
    }
}

/// Where the target is on the ground, where everything is known that this takes.
fn geo_status(shared: &Shared, state: &State, now: Instant) -> Option<CAMERA_TRACKING_GEO_STATUS_DATA> {
    let tangents = shared.facts.tangents()?;
    let tracking = current(state, now);
    let point = || {
        let (x, y) = tracking.place()?.center();
        let (right, down) = ((2.0 * x - 1.0) * tangents.0, (2.0 * y - 1.0) * tangents.1);
        ground_point(&state.vehicle.position(now)?, orientation(shared, state, now)?, right, down)
    };
    let point = point();
    let known = |of: fn(&GroundPoint) -> f64| point.as_ref().map_or(f32::NAN, |point| of(point) as f32);
    let degrees = |of: fn(&GroundPoint) -> f64| point.as_ref().map_or(i32::MAX, |p| (of(p) * 1e7).round() as i32);
    Some(CAMERA_TRACKING_GEO_STATUS_DATA {
        lat: degrees(|p| p.latitude_deg),
        lon: degrees(|p| p.longitude_deg),
        alt: known(|p| p.altitude_m),
        h_acc: known(|p| p.accuracy_m),
        v_acc: f32::NAN,
        vel_n: f32::NAN,
        vel_e: f32::NAN,
        vel_d: f32::NAN,
        vel_acc: f32::NAN,
        dist: known(|p| p.distance_m),
        hdg: f32::NAN,
        hdg_acc: f32::NAN,
        // A target whose place on the ground is not known is not followed there.
        tracking_status: match (&point, &tracking) {
            (None, Tracking::Seen(_) | Tracking::Coasting(_)) => {
                CameraTrackingStatusFlags::CAMERA_TRACKING_STATUS_FLAGS_ERROR
            }
            _ => flags(&tracking),
        },
        camera_device_id: 0,
    })
}

/// Of a target that is seen; what is only expected is nothing to land on.
fn landing_target(facts: &CameraFacts, state: &State, now: Instant) -> Option<LANDING_TARGET_DATA> {
    let (across, up) = facts.tangents()?;
    let Tracking::Seen(place) = current(state, now) else { return None };
    let angle = |part: f64, tangent: f64| ((2.0 * part - 1.0) * tangent).atan();
    let (x, y) = place.center();
    let width = angle(place.right, across) - angle(place.left, across);
    let height = angle(place.bottom, up) - angle(place.top, up);
    let distance = facts.target_width_m.map_or(0.0, |metres| 0.5 * metres / (0.5 * width).tan().max(1e-6));
    Some(LANDING_TARGET_DATA {
        time_usec: std::time::SystemTime::now()
            .duration_since(std::time::UNIX_EPOCH)
            .map_or(0, |since| since.as_micros() as u64),
        angle_x: angle(x, across) as f32,
        angle_y: angle(y, up) as f32,
        distance: distance as f32,
        size_x: width as f32,
        size_y: height as f32,
        target_num: 0,
        frame: MavFrame::MAV_FRAME_BODY_FRD,
        mavtype: LandingTargetType::LANDING_TARGET_TYPE_VISION_OTHER,
        position_valid: MavBool::MAV_BOOL_FALSE,
        ..LANDING_TARGET_DATA::default()
    })
}
