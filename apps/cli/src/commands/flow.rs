use super::print;
use crate::args::{Flow as Args, Global};
use crate::{console, memory};
use pursuit::flow::{FieldOptions, Finished, Flow, FlowConfig, PointChoice, PointOptions, Shown, Wanted};
use pursuit::geometry::{Point, Size};
use pursuit::media::{Locator, OpenOptions};
use pursuit::vision::flow::dense::{DenseFlowParams, RefinementParams};
use pursuit::vision::flow::{LucasKanadeParams, PointFollowerParams};
use std::fmt::Write;
use std::process::ExitCode;

/// `pursuit flow INPUT`.
pub fn run(args: &Args, global: &Global) -> anyhow::Result<ExitCode> {
    let config = FlowConfig {
        from: args.span.from,
        to: args.span.to,
        stride: args.span.stride,
        fps: args.span.fps,
        region: args.view.region()?,
        resize: args.view.resize()?,
        out: args.out.clone(),
        overlay: args.overlay,
        ..FlowConfig::new(Locator::from(args.input.clone()), wanted(args))
    };
    let input = config.input.clone();
    let flow = console::connecting(Some(&input), global, || Flow::prepare(config, &OpenOptions::from_env()))?;
    memory::check(flow.input().size.area())?;
    let info = flow.input().clone();
    let bar = console::progress_bar(info.frame_count, global);
    let finished = flow.run(console::stop_flag(), |frames| bar.set_position(frames))?;
    bar.finish_and_clear();
    let text = match args.json {
        true => {
            let mut facts = finished.to_json(&info);
            facts["out"] = finished.out.display().to_string().into();
            format!("{facts:#}\n")
        }
        false => console::printable(&summary(&finished)?),
    };
    let code = print(text.as_bytes())?;
    match finished.failure {
        Some(error) => Err(error.into()),
        None => Ok(code),
    }
}

/// What is asked for.
fn wanted(args: &Args) -> Wanted {
    if args.dense {
        let usual = DenseFlowParams::default();
        let params = match args.quality.as_str() {
            "fast" => DenseFlowParams { damping: usual.damping, ..DenseFlowParams::kroeger2016_fast() },
            "fine" => DenseFlowParams { damping: usual.damping, ..DenseFlowParams::kroeger2016_fine() },
            "full" => DenseFlowParams { finest: 0, ..usual },
            _ => usual,
        };
        let rounds = args.refine.unwrap_or(params.refinement.rounds);
        let params = DenseFlowParams { refinement: RefinementParams { rounds, ..params.refinement }, ..params };
        let shown = args.arrows.map_or(Shown::Wheel, Shown::Arrows);
        let (longest_px, grid_px) = (args.longest, args.grid);
        return Wanted::Field(FieldOptions { params, shown, longest_px, flo: args.flo, grid_px });
    }
    let usual = PointOptions::default();
    let choice = match (args.given.as_slice(), args.grid) {
        ([], Some(step)) => PointChoice::Grid(step),
        ([], None) => args.points.map_or(usual.choice, PointChoice::Corners),
        (points, _) => PointChoice::Given(points.iter().map(|&[x, y]| Point::new(x, y)).collect()),
    };
    let follower = PointFollowerParams {
        flow: LucasKanadeParams { window: Size::new(args.window, args.window), ..usual.follower.flow },
        max_forward_backward_px: args.forward_backward,
        least_correlation: args.likeness,
        ..usual.follower
    };
    Wanted::Points(PointOptions { choice, renew: args.renew, follower, ..PointOptions::default() })
}

fn summary(finished: &Finished) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let frames = finished.frames;
    if let Some(points) = &finished.points {
        writeln!(
            text,
            "{frames} frames  {} points  {} followed to the end  {} lost  {} left the picture  {:.2} ms a frame",
            points.started, points.tracked, points.lost, points.outside, finished.mean_ms
        )?;
    }
    if let Some(field) = &finished.field {
        writeln!(
            text,
            "{frames} frames  {} fields  mean motion {:.2} px  longest {:.1} px  {:.1} ms a field",
            field.fields, field.mean_px, field.longest_px, finished.mean_ms
        )?;
    }
    if finished.damaged > 0 {
        writeln!(text, "{} frames could not be had", finished.damaged)?;
    }
    writeln!(text, "results in {}", finished.out.display())?;
    Ok(text)
}
