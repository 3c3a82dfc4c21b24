//! Turns a camera after a walker: the whole loop, with a simulated head that obeys 150 ms late and pictures that are 150 ms old.

use pursuit::charts::{Axis, Chart, Color, Series};
use pursuit::ptz::control::{Controller, Follower, FollowerParams, Proportional};
use pursuit::ptz::simulation::{
    CameraParams, Exposure, Eye, HeadParams, NoisyEye, SimulatedCamera, SimulatedHead, Walk, Walker,
};
use std::collections::VecDeque;
use std::path::Path;

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let camera = CameraParams::usual()?;
    let head = HeadParams::default();
    let walker = Walker::new(Walk::Pacing, 5, 20.0);
    let home = pursuit::ptz::Position { direction: walker.first_view(Walk::Pacing), ..head.home };
    let params =
        FollowerParams { home, command_delay_s: head.delay_s, frame_age_s: camera.age_s, ..FollowerParams::default() };

    let mut predicting = Follower::new(params.clone(), camera.views.clone(), camera.size, 0.0)?;
    let mut chasing = Proportional::new(camera.views.clone(), camera.size, 1.5, params.period_s)?;
    let predicted = steer(&mut predicting, &camera, &HeadParams { home, ..head.clone() }, &walker)?;
    let chased = steer(&mut chasing, &camera, &HeadParams { home, ..head }, &walker)?;

    let off = |path: &[(f64, f64)]| path.iter().map(|p| p.1.abs()).sum::<f64>() / path.len() as f64;
    println!("off the middle on average: predicting {:.0} %, chasing {:.0} %", off(&predicted), off(&chased));
    Chart::new("A walker in the picture", Axis::new("time (s)"), Axis::new("off the middle (% of half the picture)"))
        .with(Series::line("chasing where it was seen", Color::Predicted, chased))
        .with(Series::line("predicting where it will be", Color::Estimate, predicted))
        .write(Path::new("steer.svg"))?;
    Ok(())
}

/// The loop: pictures are taken and arrive late, what is seen in them goes to the controller, its commands go to the head. Says how far the
/// walker was from the middle in each picture.
fn steer(
    controller: &mut dyn Controller,
    camera: &CameraParams,
    head: &HeadParams,
    walker: &Walker,
) -> Result<Vec<(f64, f64)>, Box<dyn std::error::Error>> {
    let mut head = SimulatedHead::new(head.clone(), 1)?;
    let mut camera = SimulatedCamera::new(camera.clone(), 1)?;
    let mut eye = NoisyEye::new(2.0, 0.0, 1); // stands for the tracker: boxes with an error of 2 px
    let mut under_way: VecDeque<Exposure> = VecDeque::new();
    let mut path = vec![];
    for tick in 0..1000 {
        let now_s = f64::from(tick) * 0.02;
        while camera.next_s() <= now_s {
            let time_s = camera.next_s();
            head.advance_to(time_s);
            let (exposure, arrives) = camera.take(head.position(), 0.0, walker.at(time_s))?;
            path.extend(exposure.offset().map(|(right, _)| (time_s, 100.0 * right)));
            under_way.extend(arrives.then_some(exposure));
        }
        while let Some(exposure) = under_way.pop_front_if(|e| e.arrival_s <= now_s) {
            let seen = eye.look(&exposure, controller.camera(exposure.arrival_s))?;
            controller.see(now_s, exposure.arrival_s, &*seen)?;
        }
        head.advance_to(now_s);
        if let Some(command) = controller.act(now_s, head.status().as_ref())? {
            head.command(now_s, command);
        }
    }
    Ok(path)
}
