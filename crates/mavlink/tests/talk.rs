//! A camera and a gimbal as the other side of the link sees them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use pursuit_mavlink::messages::{
    COMMAND_ACK_DATA, COMMAND_LONG_DATA, CameraTrackingMode, CameraTrackingStatusFlags,
    GIMBAL_DEVICE_ATTITUDE_STATUS_DATA, GIMBAL_MANAGER_INFORMATION_DATA, GIMBAL_MANAGER_STATUS_DATA, GimbalDeviceFlags,
    GimbalManagerCapFlags, MavCmd, MavMessage, MavResult,
};
use pursuit_mavlink::{
    Ask, Camera, CameraFacts, Endpoint, Gimbal, Identity, Incoming, MavlinkError, Place, Request, Tracking, Verdict,
};
use std::net::UdpSocket;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_secs(20);
const STATION: Identity = Identity { system: 255, component: 190 };

/// Two ends of one link.
fn link(far: Identity) -> (Endpoint, Endpoint) {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let open = |identity, kind: &str| {
        let address = format!("{kind}:127.0.0.1:{port}").parse().unwrap();
        Endpoint::start(identity, &[address], None).unwrap()
    };
    (open(Identity::default(), "udpin"), open(far, "udpout"))
}

fn wait<T>(from: &Receiver<Incoming>, fits: impl Fn(&MavMessage) -> Option<T>) -> T {
    loop {
        if let Some(found) = fits(&from.recv_timeout(PATIENCE).unwrap().message) {
            return found;
        }
    }
}

fn facts() -> CameraFacts {
    CameraFacts {
        vendor: "pursuit".into(),
        model: "test".into(),
        size: (640, 480),
        field_of_view_deg: None,
        fps: None,
        stream: None,
        pitch_deg: 0.0,
        landing_target: false,
        target_width_m: None,
        gimbal_device: 0,
    }
}

struct Scene {
    camera: Camera,
    station: Endpoint,
    heard: Receiver<Incoming>,
}

fn scene() -> Scene {
    let (near, station) = link(STATION);
    let heard = station.listen();
    let camera = Camera::start(near, facts()).unwrap();
    // The camera answers once it has heard of the station.
    wait(&heard, |message| matches!(message, MavMessage::HEARTBEAT(_)).then_some(()));
    Scene { camera, station, heard }
}

impl Scene {
    fn command(&self, command: MavCmd, params: [f32; 4], confirmation: u8) {
        let [param1, param2, param3, param4] = params;
        self.station.send(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            command,
            param1,
            param2,
            param3,
            param4,
            target_system: 1,
            target_component: 100,
            confirmation,
            ..COMMAND_LONG_DATA::default()
        }));
    }

    /// What the camera is asked, once it is.
    fn asked(&self) -> Request {
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            if let Some(request) = self.camera.asked() {
                return request;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        panic!("nothing was asked");
    }

    fn answer(&self) -> (MavResult, i32) {
        wait(&self.heard, |message| match message {
            MavMessage::COMMAND_ACK(ack) => Some((ack.result, ack.result_param2)),
            _ => None,
        })
    }
}

#[test]
fn what_is_asked_is_answered_when_it_is_done() {
    let scene = scene();
    scene.command(MavCmd::MAV_CMD_CAMERA_TRACK_RECTANGLE, [0.5, 0.6, 0.25, 0.125], 0);
    let request = scene.asked();
    assert_eq!(request.ask, Ask::Rectangle(Place { left: 0.25, top: 0.125, right: 0.5, bottom: f64::from(0.6_f32) }));
    assert_eq!(request.from(), (255, 190));
    request.answer(Verdict::Done(2));
    assert_eq!(scene.answer(), (MavResult::MAV_RESULT_ACCEPTED, 2));
    // The same again is answered, and asked of nobody.
    scene.command(MavCmd::MAV_CMD_CAMERA_TRACK_RECTANGLE, [0.5, 0.6, 0.25, 0.125], 1);
    assert_eq!(scene.answer(), (MavResult::MAV_RESULT_ACCEPTED, 2));
    assert!(scene.camera.asked().is_none());
    scene.command(MavCmd::MAV_CMD_CAMERA_STOP_TRACKING, [0.0; 4], 0);
    drop(scene.asked());
    assert_eq!(scene.answer().0, MavResult::MAV_RESULT_TEMPORARILY_REJECTED, "nobody took care of it");
    scene.command(MavCmd::MAV_CMD_CAMERA_TRACK_POINT, [f32::NAN, 0.5, 0.0, 0.0], 0);
    assert_eq!(scene.answer().0, MavResult::MAV_RESULT_DENIED);
    scene.command(MavCmd::MAV_CMD_IMAGE_START_CAPTURE, [0.0; 4], 0);
    assert_eq!(scene.answer().0, MavResult::MAV_RESULT_UNSUPPORTED);
}

#[test]
fn what_no_tracker_takes_is_refused_for_now_and_the_newest_is_meant() {
    let scene = scene();
    let ask = |x: f32, confirmation| {
        scene.command(MavCmd::MAV_CMD_CAMERA_TRACK_POINT, [x, 0.5, 0.0, 0.0], confirmation);
    };
    let not_now = (MavResult::MAV_RESULT_TEMPORARILY_REJECTED, 0);
    ask(0.25, 0);
    assert_eq!(scene.answer(), not_now, "nobody took it");
    assert!(scene.camera.asked().is_none(), "whoever asked has given up");
    ask(0.25, 0);
    // The same again is the same question, and another one takes its place.
    ask(0.25, 1);
    ask(0.75, 0);
    assert_eq!(scene.answer(), not_now);
    let request = scene.asked();
    assert_eq!(request.ask, Ask::Point { x: 0.75, y: 0.5, radius: 0.0 });
    ask(0.75, 1);
    std::thread::sleep(Duration::from_millis(100));
    assert!(scene.camera.asked().is_none(), "it is under way");
    request.answer(Verdict::Done(3));
    assert_eq!(scene.answer(), (MavResult::MAV_RESULT_ACCEPTED, 3));
    // With the camera goes what still waits.
    let Scene { camera, heard, station } = scene;
    let stop = COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_CAMERA_STOP_TRACKING,
        target_system: 1,
        target_component: 100,
        ..COMMAND_LONG_DATA::default()
    };
    station.send(&MavMessage::COMMAND_LONG(stop));
    std::thread::sleep(Duration::from_millis(200));
    drop(camera);
    let answered = |message: &MavMessage| match message {
        MavMessage::COMMAND_ACK(ack) => Some(ack.result),
        _ => None,
    };
    assert_eq!(wait(&heard, answered), not_now.0);
    let last = |message: &MavMessage| match message {
        MavMessage::CAMERA_TRACKING_IMAGE_STATUS(status) => Some(status.tracking_status),
        _ => None,
    };
    assert_eq!(wait(&heard, last), CameraTrackingStatusFlags::empty(), "it tracks nothing any more");
}

#[test]
fn a_point_is_only_told_once_it_is_followed() {
    let scene = scene();
    scene.command(MavCmd::MAV_CMD_CAMERA_TRACK_RECTANGLE, [0.25, 0.25, 0.5, 0.5], 0);
    scene.asked().answer(Verdict::Done(0));
    let place = Place { left: 0.25, top: 0.25, right: 0.5, bottom: 0.5 };
    let mode = || {
        scene.camera.tell(Tracking::Lost);
        scene.camera.tell(Tracking::Seen(place));
        wait(&scene.heard, |message| match message {
            MavMessage::CAMERA_TRACKING_IMAGE_STATUS(s) if !s.rec_top_x.is_nan() => Some(s.tracking_mode),
            _ => None,
        })
    };
    scene.command(MavCmd::MAV_CMD_CAMERA_TRACK_POINT, [0.5, 0.5, 0.0, 0.0], 0);
    scene.asked().answer(Verdict::Failed);
    assert_eq!(mode(), CameraTrackingMode::CAMERA_TRACKING_MODE_RECTANGLE);
    scene.command(MavCmd::MAV_CMD_CAMERA_TRACK_POINT, [0.5, 0.5, 0.0, 0.0], 0);
    scene.asked().answer(Verdict::Done(3));
    assert_eq!(mode(), CameraTrackingMode::CAMERA_TRACKING_MODE_POINT);
}

#[test]
fn the_state_is_told_with_a_place_or_without() {
    let Scene { camera, heard, station: _open } = scene();
    let status = |tracking: Tracking, flags: CameraTrackingStatusFlags| {
        camera.tell(tracking);
        wait(&heard, |message| match message {
            MavMessage::CAMERA_TRACKING_IMAGE_STATUS(status) if status.tracking_status == flags => Some(status.clone()),
            _ => None,
        })
    };
    let place = Place { left: 0.25, top: 0.5, right: 0.75, bottom: 0.75 };
    let active = CameraTrackingStatusFlags::CAMERA_TRACKING_STATUS_FLAGS_ACTIVE;
    let seen = status(Tracking::Seen(place), active);
    assert_eq!((seen.rec_top_x, seen.rec_bottom_y, seen.point_x), (0.25, 0.75, 0.5));
    assert_eq!(seen.tracking_mode, CameraTrackingMode::CAMERA_TRACKING_MODE_RECTANGLE);
    let coasting = CameraTrackingStatusFlags::CAMERA_TRACKING_STATUS_FLAGS_COASTING;
    assert_eq!(status(Tracking::Coasting(place), active | coasting).rec_top_x, 0.25);
    let lost = status(Tracking::Lost, CameraTrackingStatusFlags::CAMERA_TRACKING_STATUS_FLAGS_ERROR);
    assert!(lost.rec_top_x.is_nan() && lost.point_y.is_nan() && lost.radius.is_nan());
    let idle = status(Tracking::Idle, CameraTrackingStatusFlags::empty());
    assert!(idle.rec_top_x.is_nan() && idle.tracking_mode == CameraTrackingMode::CAMERA_TRACKING_MODE_NONE);
    // Pictures that cease are noticed.
    camera.tell(Tracking::Seen(place));
    let error = CameraTrackingStatusFlags::CAMERA_TRACKING_STATUS_FLAGS_ERROR;
    wait(&heard, |message| match message {
        MavMessage::CAMERA_TRACKING_IMAGE_STATUS(status) => (status.tracking_status == error).then_some(()),
        _ => None,
    });
}

/// A gimbal that turns with its vehicle and answers what it is asked, until `ends` commands have come.
fn gimbal(manager: &Endpoint, refuses: bool) -> std::thread::JoinHandle<Vec<(f32, f32)>> {
    let (manager, heard) = (manager.clone(), manager.listen());
    std::thread::spawn(move || {
        let mut rates = Vec::new();
        while let Ok(incoming) = heard.recv_timeout(Duration::from_secs(5)) {
            let attitude = GIMBAL_DEVICE_ATTITUDE_STATUS_DATA {
                // Half a radian to the right.
                q: [(0.25_f32).cos(), 0.0, 0.0, (0.25_f32).sin()],
                flags: GimbalDeviceFlags::GIMBAL_DEVICE_FLAGS_YAW_LOCK,
                ..GIMBAL_DEVICE_ATTITUDE_STATUS_DATA::default()
            };
            manager.send(&MavMessage::GIMBAL_DEVICE_ATTITUDE_STATUS(attitude));
            match &*incoming.message {
                MavMessage::GIMBAL_MANAGER_SET_PITCHYAW(set) => rates.push((set.yaw_rate, set.pitch_rate)),
                MavMessage::COMMAND_LONG(command) => {
                    if command.param1 == 280.0 {
                        manager.send(&MavMessage::GIMBAL_MANAGER_INFORMATION(GIMBAL_MANAGER_INFORMATION_DATA {
                            cap_flags: GimbalManagerCapFlags::GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK,
                            gimbal_device_id: 154,
                            pitch_min: -1.5,
                            pitch_max: 0.5,
                            ..GIMBAL_MANAGER_INFORMATION_DATA::default()
                        }));
                        continue;
                    }
                    let (refused, done) = (MavResult::MAV_RESULT_DENIED, MavResult::MAV_RESULT_ACCEPTED);
                    manager.send(&MavMessage::COMMAND_ACK(COMMAND_ACK_DATA {
                        command: command.command,
                        result: if refuses { refused } else { done },
                        target_system: 1,
                        target_component: 100,
                        ..COMMAND_ACK_DATA::default()
                    }));
                    if command.param1 == -3.0 {
                        return rates;
                    }
                }
                _ => {}
            }
        }
        rates
    })
}

const GIMBAL: Identity = Identity { system: 1, component: 154 };

#[test]
fn a_gimbal_is_taken_turned_and_given_back() {
    let (near, far) = link(GIMBAL);
    let behind = gimbal(&far, false);
    let found = Gimbal::find(near, None).unwrap();
    assert_eq!((found.id().component, found.id().device, found.holds_yaw()), (154, 154, true));
    assert!((found.limits().pitch_deg.0 + 85.94).abs() < 0.01 && found.limits().yaw_deg.1.is_infinite());
    let attitude = found.wait_for_attitude().unwrap();
    assert!((attitude.yaw_deg - 28.648).abs() < 0.01 && attitude.is_of_earth, "{attitude:?}");
    found.turn(10.0, -5.0);
    far.send(&MavMessage::GIMBAL_MANAGER_STATUS(GIMBAL_MANAGER_STATUS_DATA {
        primary_control_sysid: 1,
        primary_control_compid: 100,
        gimbal_device_id: 154,
        ..GIMBAL_MANAGER_STATUS_DATA::default()
    }));
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(found.taken_by(), None, "it is this one itself");
    drop(found);
    let rates = behind.join().unwrap();
    assert!(
        rates.len() == 2 && (rates[0].0 - 0.174_533).abs() < 1e-5 && (rates[0].1 + 0.087_266).abs() < 1e-5,
        "{rates:?}"
    );
    assert_eq!(rates[1], (0.0, 0.0), "it stands when it is given back");
}

#[test]
fn what_another_gimbal_says_is_not_believed() {
    let (near, far) = link(GIMBAL);
    let behind = gimbal(&far, false);
    let found = Gimbal::find(near, None).unwrap();
    found.wait_for_attitude().unwrap();
    let other =
        GIMBAL_DEVICE_ATTITUDE_STATUS_DATA { gimbal_device_id: 3, q: [1.0, 0.0, 0.0, 0.0], ..Default::default() };
    let taken = GIMBAL_MANAGER_STATUS_DATA { gimbal_device_id: 3, primary_control_sysid: 7, ..Default::default() };
    let own = GIMBAL_MANAGER_STATUS_DATA { gimbal_device_id: 154, ..taken.clone() };
    far.send(&MavMessage::GIMBAL_DEVICE_ATTITUDE_STATUS(other));
    far.send(&MavMessage::GIMBAL_MANAGER_STATUS(taken));
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(found.taken_by(), None);
    assert!((found.attitude().unwrap().yaw_deg - 28.648).abs() < 0.01);
    far.send(&MavMessage::GIMBAL_MANAGER_STATUS(own));
    let until = Instant::now() + PATIENCE;
    while found.taken_by().is_none() {
        assert!(Instant::now() < until, "its own manager is heard");
    }
    drop((found, far));
    behind.join().unwrap();
}

#[test]
fn a_gimbal_that_refuses_or_is_not_there_is_an_error() {
    let (near, far) = link(GIMBAL);
    let behind = gimbal(&far, true);
    assert!(matches!(Gimbal::find(near.clone(), None), Err(MavlinkError::Refused { .. })));
    assert!(matches!(Gimbal::find(near, Some(77)), Err(MavlinkError::NoGimbal { .. })));
    behind.join().unwrap();
}
