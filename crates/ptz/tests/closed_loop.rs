//! The loop in simulation.
use pursuit_ptz::control::{Controller, Follower, FollowerParams, PredictBy, Proportional, Scheme, StopAndGo};
use pursuit_ptz::simulation::{CameraParams, Figures, HeadParams, NoisyEye, Simulation, Walk, Walker, run, StatusHonesty, overshoot, wandering_deg};

fn usual() -> Simulation {
    Simulation { head: HeadParams::default(), camera: CameraParams::usual().unwrap(), duration_s: 30.0, tick_s: 0.02 }
}
fn params() -> FollowerParams {
    FollowerParams { command_delay_s: 0.15, frame_age_s: 0.15, ..FollowerParams::default() }
}
type Make = dyn Fn(&Simulation) -> Box<dyn Controller>;
fn follower(p: FollowerParams) -> Box<Make> {
    Box::new(move |s| Box::new(Follower::new(FollowerParams { home: s.head.home, ..p.clone() }, s.camera.views.clone(), s.camera.size, 0.0).unwrap()))
}
fn figures(sim: &Simulation, walk: Walk, seeds: u64, make: &Make) -> Figures {
    let runs: Vec<Figures> = (0..seeds).map(|seed| {
        let walker = Walker::new(walk, seed, sim.duration_s);
        let mut sim = sim.clone();
        sim.head.home.direction = walker.first_view(walk);
        let sim = &sim;
        let mut eye = NoisyEye::new(2.0, 0.0, seed);
        let mut controller = make(sim);
        let samples = run(sim, seed, &|t| walker.at(t), &mut eye, &mut *controller).unwrap();
        Figures::of(&samples, 3.0)
    }).collect();
    Figures::mean(&runs)
}
#[test]
fn explore() {
    let plain = usual();
    let mut rough = usual();
    rough.head.dropped = 0.05; rough.head.jitter_s = 0.1; rough.head.status = StatusHonesty::AlwaysMoving; rough.camera.jitter_s=0.0;
    let mut rough2 = rough.clone(); rough2.camera.jitter_s = 0.1; rough2.head.limits.pan.backlash_deg=0.3; rough2.head.quantum_deg=0.1;rough2.head.speed_scale=1.1;
    let mut controllers: Vec<(String, Box<Make>)> = vec![];
    for (timing_s, jitter_s, brisk, gain) in [(0.1,0.05,200.0,3.5),(0.1,0.05,200.0,4.0),(0.1,0.04,200.0,3.5),(0.1,0.05,400.0,3.5),(0.1,0.06,400.0,4.0)] {
        let mut p = params(); p.motion.timing_s=timing_s; p.motion.jitter_s=jitter_s; p.motion.brisk_deg2_s3=brisk; p.gain_per_s=gain;
        controllers.push((format!("{timing_s} {jitter_s} {brisk} {gain}"), follower(p)));
    }
    let mut p = params(); p.predict_by=PredictBy::Nothing; p.gain_per_s=3.5; controllers.push(("nothing".into(), follower(p)));
    for (name, sim) in [("plain", &plain), ("rough", &rough), ("rough2", &rough2)] {
        for walk in [Walk::Pacing] {
            for (c, make) in &controllers {
                let f = figures(sim, walk, 20, make);
                println!("{name:8} {:9} {c:18} central {:.3} rms {:.2} shown {:.4} absent {:.2}", walk.name(), f.central, f.rms_deg, f.shown, f.longest_absence_s);
            }
        }
    }
    for (c, make) in &controllers {
        for sim in [&plain, &rough2] {
        let (mut o, mut w): (f64,f64) = (0.0,0.0);
        for seed in 0..10 {
            let walker = Walker::new(Walk::Standing, seed, 30.0);
            let mut sim = sim.clone();
            sim.head.home.direction = walker.first_view(Walk::Standing);
            let sim = &sim;
            let mut eye = NoisyEye::new(2.0, 0.0, seed);
            let mut controller = make(sim);
            let s = run(sim, seed, &|t| walker.at(t), &mut eye, &mut *controller).unwrap();
            o = o.max(overshoot(&s)); w = w.max(wandering_deg(&s, 5.0));
        }
        println!("{c:18} overshoot {o:.3} wandering {w:.3}");
        }
    }
}
