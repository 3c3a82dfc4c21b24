#![allow(missing_docs, warnings, clippy::all)]
use pursuit_evaluation::boxes::read_boxes;
use pursuit_evaluation::*;
use pursuit_parameters::Parameters;
use pursuit_tracking::many::*;
use pursuit_tracking::*;
use std::fmt::Write as _;
use std::path::PathBuf;

fn parse(arg: &str) -> (ManyParams, Option<OfflineParams>) {
    let mut params = ManyParams::default();
    let mut off: Option<OfflineParams> = None;
    for kv in arg.split(';').filter(|s| !s.is_empty()) {
        if let Some(p) = kv.strip_prefix("preset=") {
            params = p.parse::<Preset>().unwrap().params();
            continue;
        }
        if kv == "offline" {
            off = Some(OfflineParams::default());
            continue;
        }
        let (k, v) = kv.split_once('=').unwrap();
        let v = if v.parse::<f64>().is_ok() || v == "true" || v == "false" { v.to_owned() } else { format!("'{v}'") };
        let (k, of) = match k.strip_prefix("off.") {
            Some(k) => (k, true),
            None => (k, false),
        };
        let parts: Vec<&str> = k.split('.').collect();
        let mut text = String::new();
        if parts.len() > 1 {
            writeln!(text, "[{}]", parts[..parts.len() - 1].join(".")).unwrap();
        }
        writeln!(text, "{} = {}", parts[parts.len() - 1], v).unwrap();
        let t = text.parse().unwrap();
        if of {
            off = Some(off.unwrap_or_default().with("offline", &t).unwrap());
        } else {
            params = params.with("many", &t).unwrap();
        }
    }
    (params, off)
}

fn lone(args: &[String], parse: &dyn Fn(&str) -> ManyParams) {
    let mut files: Vec<PathBuf> = ["sot", "sot2", "sot3"]
        .iter()
        .flat_map(|d| std::fs::read_dir(format!("/work/shared/data/{d}")).unwrap().map(|e| e.unwrap().path()))
        .filter(|p| p.extension().is_some_and(|e| e == "csv"))
        .collect();
    files.sort();
    for arg in args {
        let params = parse(arg);
        let mut total = 0;
        let mut worst: Vec<(u64, String)> = vec![];
        let (mut shown, mut all) = (0, 0);
        for f in &files {
            let text = std::fs::read_to_string(f).unwrap();
            let mut many = Associating::fed(params.clone()).unwrap();
            for (k, l) in text.lines().skip(1).enumerate() {
                let v: Vec<f64> = l.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect();
                let b = pursuit_geometry::BBox::from_ltwh(v[1], v[2], v[3], v[4]);
                let d: Vec<Detection> = if k % 4 == 3 || !b.is_finite() {
                    vec![]
                } else {
                    all += 1;
                    vec![Detection::new(b, 0.9)]
                };
                let t = many.update(k as f64 / 25.0, None, &d).unwrap();
                shown +=
                    t.iter().filter(|t| t.estimate.as_ref().is_some_and(|e| e.state == TrackState::Tracking)).count();
            }
            total += many.last_id();
            worst.push((many.last_id(), f.file_stem().unwrap().to_string_lossy().into()));
        }
        worst.sort();
        worst.reverse();
        println!(
            "{arg}: {} sequences {total} ids, shown {:.3} {:?}",
            files.len(),
            shown as f64 / all as f64,
            &worst[..12]
        );
    }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if std::env::var("LONE").is_ok() {
        lone(&args, &|a| parse(a).0);
        return;
    }
    let root = PathBuf::from("/work/shared/data/mot");
    let roots: Vec<PathBuf> =
        ["mot15", "car-rrc", "car-pointrcnn", "ped-yolox", "ped-pointrcnn"].iter().map(|s| root.join(s)).collect();
    let seqs = CrowdSequence::discover_all(&roots, None).unwrap();
    let dets: Vec<_> =
        seqs.iter().map(|s| read_boxes(s.detections.as_ref().unwrap(), None, s.size).unwrap().in_pixels()).collect();
    println!(
        "{:60} {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>5}",
        "what", "PETS", "rrc", "prcnn", "yolox", "pedpr", "mean", "IDSW"
    );
    let reps: u64 = std::env::var("REP").ok().map_or(1, |r| r.parse().unwrap());
    use rayon::prelude::*;
    let lines: Vec<String> = args
        .par_iter()
        .enumerate()
        .map(|(n, arg)| {
            let mut sums = [0.0; 5];
            let mut sws = 0;
            let mut det = String::new();
            let (params, off) = parse(arg);
            for rep in 0..reps {
                let out = std::env::temp_dir().join(format!("lab{}_{n}_{rep}", std::process::id()));
                for (s, boxes) in seqs.iter().zip(&dets) {
                    let fps = s.fps.unwrap_or(25.0);
                    let frames = s.frames.unwrap_or(0).max(boxes.frames());
                    let mut text = String::new();
                    let det = |f: u64| -> Vec<Detection> {
                        boxes
                            .of(f)
                            .iter()
                            .enumerate()
                            .filter(|(k, _)| {
                                let mut x = (rep << 40) ^ (f << 12) ^ *k as u64;
                                x = (x ^ (x >> 30)).wrapping_mul(0xbf58476d1ce4e5b9);
                                x = (x ^ (x >> 27)).wrapping_mul(0x94d049bb133111eb);
                                x ^= x >> 31;
                                rep == 0 || x % 100 >= 3
                            })
                            .map(|(_, r)| Detection::new(r.bbox, r.score))
                            .collect()
                    };
                    if let Some(o) = &off {
                        let looked: Vec<Looked> =
                            (0..frames).map(|f| Looked { time_s: f as f64 / fps, detections: det(f) }).collect();
                        for (f, placed) in offline(params.clone(), o, s.size, &looked).unwrap().iter().enumerate() {
                            for p in placed {
                                let (l, t, w, h) = p.bbox.ltwh();
                                let (l, t) = (l + 1.0, t + 1.0);
                                writeln!(text, "{},{},{l},{t},{w},{h},{},-1,-1,-1", f + 1, p.id, p.score).unwrap();
                            }
                        }
                    } else {
                        let mut many = Associating::fed(params.clone()).unwrap();
                        for f in 0..frames {
                            for tr in many.update(f as f64 / fps, s.size, &det(f)).unwrap() {
                                let Some(e) = tr.estimate.as_ref().filter(|e| e.state == TrackState::Tracking) else {
                                    continue;
                                };
                                let (l, t, w, h) = e.bbox.ltwh();
                                let (l, t) = (l + 1.0, t + 1.0);
                                writeln!(text, "{},{},{l},{t},{w},{h},{},-1,-1,-1", f + 1, tr.id, e.score).unwrap();
                            }
                        }
                    }
                    let p = out.join(&s.set).join(format!("{}.txt", s.name));
                    std::fs::create_dir_all(p.parent().unwrap()).unwrap();
                    std::fs::write(p, text).unwrap();
                }
                let options = CrowdOptions {
                    datasets: roots.clone(),
                    sequences: None,
                    given: vec![Given { name: "t".into(), path: out.clone() }],
                    rules: "auto".parse().unwrap(),
                    out: out.join("res"),
                    report: false,
                };
                let res = evaluate_crowds(&options).unwrap();
                let t = &res.trackers["t"];
                let h = |s: &str| 100.0 * t.sets[s].HOTA;
                for (n, f) in &t.sets {
                    writeln!(det, "  {n:16} HOTA {:.2} DetA {:.2} AssA {:.2} DetRe {:.2} DetPr {:.2} AssRe {:.2} AssPr {:.2} MOTA {:.2} IDF1 {:.2} IDSW {} TP {} FP {} FN {}", 100.*f.HOTA, 100.*f.DetA, 100.*f.AssA, 100.*f.MOTA, 100.*f.IDF1, f.IDSW, f.TP, f.FP, f.FN).unwrap();
                }
                let sw: u64 = t.sets.values().map(|f| f.IDSW as u64).sum();
                let v = [h("mot15"), h("car-rrc"), h("car-pointrcnn"), h("ped-yolox"), h("ped-pointrcnn")];
                for i in 0..5 {
                    sums[i] += v[i] / reps as f64;
                }
                sws += sw;
                std::fs::remove_dir_all(&out).ok();
            }
            let v = sums;
            let sw = sws / reps;
            if std::env::var("DET").is_ok() { println!("{arg}\n{det}"); }
            format!(
                "{:60} {:6.2} {:6.2} {:6.2} {:6.2} {:6.2} {:6.2} {:5}",
                arg,
                v[0],
                v[1],
                v[2],
                v[3],
                v[4],
                v.iter().sum::<f64>() / 5.0,
                sw
            )
        })
        .collect();
    for l in lines {
        println!("{l}");
    }
}
