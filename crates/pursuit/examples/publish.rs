//! What publishing costs the tracker: the same run with and without it, by turns.
//!
//! `publish ADDRESS [TARGETS [FRAMES [PAIRS]]]` follows so many targets with `mosse` on one thread, each frame a message for
//! each, and prints for every pair of runs the processor time of the tracker's thread, the wall time of its frames, and what
//! became of the messages; at the end the medians of the ratios. Nothing paces the run: it publishes as fast as it tracks.

use pursuit::media::OpenOptions;
use pursuit::{Run, RunConfig, RunError};
use rustix::time::{ClockId, clock_gettime};
use std::error::Error;
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default| arguments.get(at).map_or(Ok(default), |text| text.parse::<u64>());
    let Some(address) = arguments.first() else {
        return Err("usage: publish ADDRESS [TARGETS [FRAMES [PAIRS]]]".into());
    };
    let (targets, frames, pairs) = (number(1, 100)?, number(2, 600)?, number(3, 5)?);
    // All targets on this thread, so that its processor time is theirs.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    let mut ratios = (Vec::new(), Vec::new());
    for pair in 0..pairs {
        // Whoever comes first may find a colder machine.
        let (mut with, mut without) = (None, None);
        for publishes in [pair % 2 == 0, pair % 2 == 1] {
            let measured = run(publishes.then_some(address.as_str()), targets, frames)?;
            *(if publishes { &mut with } else { &mut without }) = Some(measured);
        }
        let (Some(with), Some(without)) = (with, without) else { continue };
        ratios.0.push(with.processor_s / without.processor_s);
        ratios.1.push(with.wall_s / without.wall_s);
        println!(
            "processor {:.3} s with, {:.3} s without; wall {:.3} s with, {:.3} s without; {}",
            with.processor_s, without.processor_s, with.wall_s, without.wall_s, with.messages
        );
    }
    println!("median ratios: processor {:.4}, wall {:.4}", median(ratios.0), median(ratios.1));
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

struct Measured {
    /// Of the tracker's thread.
    processor_s: f64,
    /// From the first frame to the last.
    wall_s: f64,
    messages: String,
}

fn run(address: Option<&str>, targets: u64, frames: u64) -> Result<Measured, RunError> {
    let boxes = (0..targets).map(|n| [16.0 + (n % 20) as f64 * 13.0, 16.0 + (n / 20 % 10) as f64 * 17.0, 24.0, 24.0]);
    let config = RunConfig {
        input: Some(format!("scene:drift?seed=7&duration={}", frames / 30 + 1).into()),
        boxes: boxes.collect(),
        tracker: Some("mosse".into()),
        publish: address.map(Into::into),
        to: Some(frames),
        ..RunConfig::default()
    };
    let run = Run::prepare(config, &OpenOptions::default())?.unwritten();
    let (before, mut first, mut last) = (thread_time(), None, Instant::now());
    let finished = run.run(|_| {
        last = Instant::now();
        first.get_or_insert(last);
    })?;
    let processor_s = (thread_time() - before).as_secs_f64();
    let wall_s = first.map_or(0.0, |first| (last - first).as_secs_f64());
    let messages = finished.facts.publish.map_or_else(String::new, |published| {
        let (all, dropped) = (published.messages, published.dropped);
        format!(
            "{all} messages, {:.0} a second, {:.0} a processor second of the tracker, {dropped} dropped",
            all as f64 / wall_s,
            all as f64 / processor_s
        )
    });
    Ok(Measured { processor_s, wall_s, messages })
}

/// Processor time of this thread.
fn thread_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}
