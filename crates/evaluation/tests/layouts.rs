//! Every layout that trackers are published on, made up of a few pixels.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;
use common::{Scripted, write, write_images};
use pursuit_evaluation::{Dataset, EvalOptions, Footage, Sequence, Truth, evaluate};
use pursuit_geometry::BBox;
use pursuit_media::OpenOptions;
use std::path::Path;
use std::sync::atomic::AtomicBool;

fn discover(root: &Path) -> Dataset {
    Dataset::discover(root, &OpenOptions::default()).unwrap()
}

fn names(dataset: &Dataset) -> Vec<&str> {
    assert!(dataset.problems.is_empty(), "{:?}", dataset.problems);
    dataset.sequences.iter().map(Sequence::name).collect()
}

fn visible(l: f64, t: f64, w: f64, h: f64) -> Truth {
    Truth::Visible(BBox::from_ltwh(l, t, w, h))
}

fn skipped(sequence: &Sequence) -> usize {
    match sequence.footage() {
        Footage::Input { first, .. } => *first,
        Footage::Memory(_) => panic!("made of files"),
    }
}

/// All sequences can be played to their end.
fn plays(root: &Path) {
    let out = tempfile::tempdir().unwrap();
    let mut options = EvalOptions::new(vec![root.to_owned()], vec![Scripted::still().entry()], out.path().to_owned());
    options.report = false;
    let results = evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap();
    for (name, score) in &results.trackers["still"].sequences {
        assert_eq!(score.error, None, "{name}");
        assert!(score.frames > 0 && score.auc > 0.0, "{name}: {score:?}");
    }
}

#[test]
fn frames_csv_is_taken_as_it_is() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("deep/er/walk");
    write_images(&folder.join("img"), 4, 1, 4);
    let rows = "index,image,x,y,w,h\n0,img/0001.png,nan,nan,nan,nan\n1,img/0002.png,2,3,4,5\n2,img/0003.png,,,,\n\
                3,img/0004.png,2.5,3,4,5\n";
    write(&folder.join("frames.csv"), rows);
    let dataset = discover(root.path());
    assert_eq!(names(&dataset), ["deep/er/walk"]);
    let expected = [Truth::Absent, visible(2.0, 3.0, 4.0, 5.0), Truth::Unknown, visible(2.5, 3.0, 4.0, 5.0)];
    assert_eq!(dataset.sequences[0].truth(), expected);
    // The sequence itself, or its list, may be named too.
    assert_eq!(names(&discover(&folder)), ["walk"]);
    assert_eq!(names(&discover(&folder.join("frames.csv"))), ["walk"]);
    plays(root.path());
}

#[test]
fn otb_files_are_read_in_all_spellings() {
    let root = tempfile::tempdir().unwrap();
    write_images(&root.path().join("Jogging/img"), 3, 1, 4);
    write(&root.path().join("Jogging/groundtruth_rect.1.txt"), "2,3,4,5\n3,3,4,5\n4,3,4,5\n");
    write(&root.path().join("Jogging/groundtruth_rect.2.txt"), "7\t3\t4\t5\n7\t3\t4\t5\n7\t3\t4\t5\r\n");
    write_images(&root.path().join("Human4/img"), 2, 1, 4);
    write(&root.path().join("Human4/groundtruth_rect.1.txt"), "");
    write(&root.path().join("Human4/groundtruth_rect.2.txt"), "5 6 4 3\n5 6 4 3\n");
    write_images(&root.path().join("Freeman4/img"), 300, 1, 4);
    write(&root.path().join("Freeman4/groundtruth_rect.txt"), &"5,6,4,3\n".repeat(283));
    let dataset = discover(root.path());
    assert_eq!(names(&dataset), ["Freeman4", "Human4", "Jogging.1", "Jogging.2"]);
    assert_eq!(dataset.sequences[2].truth()[1], visible(2.0, 2.0, 4.0, 5.0));
    assert_eq!(dataset.sequences[3].truth()[0], visible(6.0, 2.0, 4.0, 5.0));
    assert_eq!((dataset.sequences[0].truth().len(), skipped(&dataset.sequences[0])), (283, 0));
    plays(root.path());
}

#[test]
fn otb_david_starts_at_its_300th_image() {
    let root = tempfile::tempdir().unwrap();
    write_images(&root.path().join("David/img"), 770, 1, 4);
    write(&root.path().join("David/groundtruth_rect.txt"), &"5,6,4,3\n".repeat(471));
    let dataset = discover(root.path());
    assert_eq!((names(&dataset), skipped(&dataset.sequences[0])), (vec!["David"], 299));
}

#[test]
fn vot_reads_polygons_rectangles_colour_folders_and_lists() {
    let root = tempfile::tempdir().unwrap();
    write_images(&root.path().join("bag"), 2, 1, 8);
    write(&root.path().join("bag/groundtruth.txt"), "2,1,8,3,6,7,0.5,5\nnan,nan,nan,nan,nan,nan,nan,nan\n");
    write_images(&root.path().join("ball/color"), 2, 1, 8);
    write(&root.path().join("ball/groundtruth.txt"), "1,2,3,4\n0\n");
    write_images(&root.path().join("unlisted"), 2, 1, 8);
    write(&root.path().join("unlisted/groundtruth.txt"), "1,2,3,4\n1,2,3,4\n");
    write(&root.path().join("list.txt"), "ball\nbag\n");
    let dataset = discover(root.path());
    assert_eq!(names(&dataset), ["bag", "ball"]);
    assert_eq!(dataset.sequences[0].truth(), [visible(0.5, 1.0, 7.5, 6.0), Truth::Absent]);
    assert_eq!(dataset.sequences[1].truth(), [visible(1.0, 2.0, 3.0, 4.0), Truth::Unknown]);
    plays(root.path());
}

#[test]
fn got10k_labels_say_where_the_target_is_away() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("val/GOT-10k_Val_000001");
    write_images(&folder, 4, 1, 8);
    write(&folder.join("groundtruth.txt"), &"1.0000,2.0000,3.0000,4.0000\n".repeat(4));
    write(&folder.join("absence.label"), "0\n1\n0\n0\n");
    write(&folder.join("cover.label"), "8\n8\n0\n5\n");
    let dataset = discover(root.path());
    assert_eq!(names(&dataset), ["val/GOT-10k_Val_000001"]);
    let there = visible(1.0, 2.0, 3.0, 4.0);
    assert_eq!(dataset.sequences[0].truth(), [there, Truth::Absent, Truth::Absent, there]);
    plays(root.path());
    write(&folder.join("absence.label"), "0\n1\n");
    let problem = discover(root.path()).problems[0].to_string();
    assert!(problem.contains("absence.label") && problem.contains("2 lines for 4 boxes"), "{problem}");
}

#[test]
fn uav123_cuts_sequences_out_of_recordings() {
    let root = tempfile::tempdir().unwrap();
    write_images(&root.path().join("data_seq/UAV123/car16"), 420, 1, 6);
    write_images(&root.path().join("data_seq/UAV123/bike1"), 3, 1, 6);
    write(&root.path().join("anno/UAV123/car16_2.txt"), "2,3,4,5\nNaN,NaN,NaN,NaN\n3,3,4,5\n");
    write(&root.path().join("anno/UAV123/bike1.txt"), "2,3,4,5\n2,3,4,5\n2,3,4,5\n");
    write(&root.path().join("anno/UAV20L/car16.txt"), &"2,3,4,5\n".repeat(420));
    let dataset = discover(root.path());
    assert_eq!(names(&dataset), ["UAV20L/car16", "bike1", "car16_2"]);
    assert_eq!((skipped(&dataset.sequences[2]), skipped(&dataset.sequences[0])), (414, 0));
    assert_eq!(dataset.sequences[2].truth(), [visible(1.0, 2.0, 4.0, 5.0), Truth::Absent, visible(2.0, 2.0, 4.0, 5.0)]);
    plays(root.path());
}

#[test]
fn attributes_of_uav123_lie_beside_its_truth() {
    let root = tempfile::tempdir().unwrap();
    for name in ["bike1", "car9"] {
        write_images(&root.path().join("data_seq/UAV123").join(name), 3, 1, 6);
        write(&root.path().join(format!("anno/UAV123/{name}.txt")), "2,3,4,5\n2,3,4,5\n2,3,4,5\n");
    }
    write(&root.path().join("anno/UAV123/att/bike1.txt"), "1,0,0,0,1,0,0,0,0,0,0,1\n");
    // Of a release with one version the folder lies beside that of the version.
    write(&root.path().join("anno/att/car9.txt"), "0 0 0 0 0 0 0 0 0 0 1 0");
    let dataset = discover(root.path());
    assert_eq!((names(&dataset), dataset.problems.len()), (vec!["bike1", "car9"], 0));
    let of = |k: usize| dataset.sequences[k].attributes().iter().map(String::as_str).collect::<Vec<_>>();
    assert_eq!(of(0), ["full occlusion", "scale variation", "similar object"]);
    assert_eq!(of(1), ["camera motion"]);
    for (text, words) in
        [("1,0\n", "2 numbers instead of 12"), ("1,0,0,0,1,0,0,2,0,0,0,1", "`2` for background clutter")]
    {
        write(&root.path().join("anno/UAV123/att/bike1.txt"), text);
        let problem = discover(root.path()).problems[0].to_string();
        assert!(problem.contains("bike1.txt") && problem.contains(words), "{problem}");
    }
}

#[test]
fn tld_gives_edges_and_nan() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("06_car");
    write_images(&folder, 3, 1, 5);
    write(&folder.join("gt.txt"), "2,3,6,9\nNaN,NaN,NaN,NaN\n2.5,3,6.5,9\n");
    let dataset = discover(root.path());
    assert_eq!(names(&dataset), ["06_car"]);
    assert_eq!(dataset.sequences[0].truth(), [visible(2.0, 3.0, 4.0, 6.0), Truth::Absent, visible(2.5, 3.0, 4.0, 6.0)]);
    plays(root.path());
}

#[test]
fn mot_objects_become_sequences_of_their_own() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("MOT17-02");
    write_images(&folder.join("pictures"), 5, 1, 6);
    write(&folder.join("seqinfo.ini"), "[Sequence]\nname=MOT17-02\nimDir=pictures\nseqLength=5\n");
    let lines = "1,7,2,3,4,5,1,1,1\n2,7,3,3,4,5,1,1,1\n4,7,4,3,4,5,1,1,1\n3,12,2,3,4,5,1,1,1\n4,12,2,3,4,5,1,1,1\n\
                 1,3,2,3,4,5,0,1,1\n2,3,2,3,4,5,0,1,1\n5,9,2,3,4,5,1,1,1\n";
    write(&folder.join("gt/gt.txt"), lines);
    let dataset = discover(root.path());
    assert_eq!(names(&dataset), ["MOT17-02.7", "MOT17-02.12"], "an object marked 0 or seen once is none");
    let expected =
        [visible(1.0, 2.0, 4.0, 5.0), visible(2.0, 2.0, 4.0, 5.0), Truth::Absent, visible(3.0, 2.0, 4.0, 5.0)];
    assert_eq!(dataset.sequences[0].truth(), expected);
    assert_eq!(skipped(&dataset.sequences[1]), 2);
    plays(root.path());
}

#[test]
fn princeton_sequences_have_colour_truth_and_hidden_frames() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("zcup_move_1");
    let images = write_images(&folder.join("rgb"), 3, 1, 1);
    for (i, name) in images.iter().enumerate() {
        let to = folder.join("rgb").join(format!("r-{}-{}.png", i * 33_370, i + 1));
        std::fs::rename(folder.join("rgb").join(name), to).unwrap();
    }
    // The sensor began before the camera; one depth image is missing.
    std::fs::create_dir_all(folder.join("depth")).unwrap();
    for (time, id) in [(5000, 1), (71_740, 3)] {
        let mm = |x: usize, y: usize| (1000 + 100 * x as u16 + y as u16).rotate_left(3);
        let depth = pursuit_imaging::Image::from_fn(16, 12, mm).unwrap();
        let to = folder.join("depth").join(format!("d-{time}-{id}.png"));
        pursuit_media::wrappers::write_png(&pursuit_imaging::Frame::new(0, 0.0, depth), &to).unwrap();
    }
    write(&folder.join("init.txt"), "3,4,5,6\n");
    write(&folder.join("zcup_move_1.txt"), "3,4,5,6,1\nNaN,NaN,NaN,NaN,2\n4,4,5,6,3\n");
    let dataset = discover(root.path());
    assert_eq!(names(&dataset), ["zcup_move_1"]);
    assert_eq!(dataset.sequences[0].truth(), [visible(2.0, 3.0, 5.0, 6.0), Truth::Absent, visible(3.0, 3.0, 5.0, 6.0)]);
    plays(root.path());
    // The folder brings its depth along.
    let mut source = pursuit_media::open(folder.to_str().unwrap(), &pursuit_media::OpenOptions::default()).unwrap();
    let facts = source.info().depth.as_ref().unwrap();
    assert_eq!((facts.coding.name(), facts.pairing.paired, facts.pairing.unpaired), ("princeton", 2, 1));
    let depths: Vec<_> = std::iter::from_fn(|| source.next_frame().unwrap())
        .map(|frame| frame.depth_mm().map(|depth| depth.row(1)[2]))
        .collect();
    assert_eq!(depths, [Some(1201), None, Some(1201)]);
}

#[test]
fn depth_lies_beside_the_colours_of_cdtb() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("box_room");
    write_images(&folder.join("color"), 2, 1, 8);
    std::fs::create_dir_all(folder.join("depth")).unwrap();
    for k in 1..=2_u16 {
        let depth = pursuit_imaging::Image::from_fn(16, 12, |x, _| 900 + k + x as u16).unwrap();
        let to = folder.join("depth").join(format!("{k:08}.png"));
        pursuit_media::wrappers::write_png(&pursuit_imaging::Frame::new(0, 0.0, depth), &to).unwrap();
    }
    write(&folder.join("groundtruth.txt"), "3,4,5,6\nnan,nan,nan,nan\n");
    let dataset = discover(root.path());
    assert_eq!(dataset.sequences[0].truth(), [visible(3.0, 4.0, 5.0, 6.0), Truth::Absent]);
    let mut source = pursuit_media::open(folder.to_str().unwrap(), &pursuit_media::OpenOptions::default()).unwrap();
    let frame = source.next_frame().unwrap().unwrap();
    assert_eq!(frame.depth_mm().unwrap().row(0)[5], 906);
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(48))]

    /// Whatever a truth file holds, the search ends with sequences or with problems.
    #[test]
    fn no_truth_file_can_bring_the_search_down(text in "[-0-9naNm.,;\\t \n=e]{0,80}", layout in 0usize..5) {
        let root = tempfile::tempdir().unwrap();
        let file = ["groundtruth.txt", "gt.txt", "gt/gt.txt", "groundtruth_rect.txt", "frames.csv"][layout];
        write_images(&root.path().join("s/img"), 2, 1, 4);
        let head = if file == "frames.csv" { "index,image,x,y,w,h\n" } else { "" };
        write(&root.path().join("s").join(file), &format!("{head}{text}"));
        for sequence in discover(root.path()).sequences {
            for bbox in sequence.truth().iter().filter_map(Truth::bbox) {
                proptest::prop_assert!(bbox.is_finite() && !bbox.is_empty());
            }
        }
    }
}

#[test]
fn names_that_meet_are_told_apart() {
    let root = tempfile::tempdir().unwrap();
    for part in ["a", "b"] {
        write_images(&root.path().join(part).join("walk"), 2, 1, 4);
        write(&root.path().join(part).join("walk/groundtruth.txt"), "1,2,3,4\n1,2,3,4\n");
    }
    let roots = [root.path().join("a"), root.path().join("b")];
    let dataset = Dataset::discover_all(&roots, &OpenOptions::default()).unwrap();
    assert_eq!(names(&dataset), ["walk", "b/walk"]);
}

#[test]
fn damaged_truth_is_named_by_line() {
    let root = tempfile::tempdir().unwrap();
    let folder = |name: &str| root.path().join(name);
    for name in ["binary", "few", "infinite", "long", "mask", "negative", "sound", "gap"] {
        write_images(&folder(name), 2, 1, 4);
    }
    std::fs::write(folder("binary").join("groundtruth.txt"), [0xff, 0xfe, 0x00, 0x9f, 10]).unwrap();
    write(&folder("few").join("groundtruth.txt"), "1,2,3,4\n1,2,3\n");
    write(&folder("gap").join("groundtruth.txt"), "1,2,3,4\n\n1,2,3,4\n");
    write(&folder("infinite").join("groundtruth.txt"), "1,2,3,4\n1,2,inf,4\n");
    write(&folder("long").join("groundtruth.txt"), &"1,2,3,4\n".repeat(9));
    write(&folder("mask").join("groundtruth.txt"), "m1,2,3\n");
    write(&folder("negative").join("groundtruth.txt"), "1,2,3,4\n1,2,-3,4\n");
    write(&folder("sound").join("groundtruth.txt"), "1,2,3,4\n1,2,3,4\n\n");
    write_images(&folder("csv"), 1, 1, 4);
    write(&folder("csv").join("frames.csv"), "index,image,x,y,w,h\n0,0001.png,1,what,3,4\n");
    write_images(&folder("never"), 1, 1, 4);
    write(&folder("never").join("frames.csv"), "index,image,x,y,w,h\n0,0001.png,nan,nan,nan,nan\n");

    let dataset = discover(root.path());
    assert_eq!(dataset.sequences.iter().map(Sequence::name).collect::<Vec<_>>(), ["sound"]);
    let problems: Vec<String> = dataset.problems.iter().map(ToString::to_string).collect();
    for expected in [
        ["binary/groundtruth.txt:1", "is not a number"],
        ["few/groundtruth.txt:2", "3 numbers"],
        ["gap/groundtruth.txt:2", "0 numbers"],
        ["infinite/groundtruth.txt:2", "`inf` is not a number"],
        ["long/groundtruth.txt", "9 boxes for the 2 images"],
        ["mask/groundtruth.txt:1", "mask"],
        ["negative/groundtruth.txt:2", "must not be negative"],
        ["csv/frames.csv", "line 2"],
        ["never", "no frame has a box"],
    ] {
        let named = problems.iter().any(|p| expected.iter().all(|e| p.contains(e)));
        assert!(named, "{expected:?} is not among {problems:#?}");
    }
}

#[test]
fn empty_folders_explain_the_layouts() {
    let root = tempfile::tempdir().unwrap();
    let run = |path: &Path| {
        let options = EvalOptions::new(vec![path.to_owned()], vec![Scripted::still().entry()], root.path().join("out"));
        evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap_err().to_string()
    };
    assert!(run(root.path()).contains("frames.csv"));
    assert!(run(&root.path().join("nowhere")).contains("nowhere"));
}

#[test]
fn tags_of_vot_and_classes_of_got10k_are_attributes() {
    let root = tempfile::tempdir().unwrap();
    let vot = root.path().join("vot");
    write_images(&vot, 2, 1, 8);
    write(&vot.join("groundtruth.txt"), "1,1,4,4\n1,1,4,4\n");
    write(&vot.join("occlusion.tag"), "0\n1\n");
    write(&vot.join("camera_motion.tag"), "0\n0\n");
    let got = root.path().join("got");
    write_images(&got, 2, 1, 8);
    write(&got.join("groundtruth.txt"), "1,1,4,4\n1,1,4,4\n");
    write(&got.join("meta_info.ini"), "[METAINFO]\nobject_class: lion\nmajor_class: animal\nmotion_class: walking\n");
    let dataset = Dataset::discover(root.path(), &OpenOptions::default()).unwrap();
    let attributes: Vec<Vec<&str>> =
        dataset.sequences.iter().map(|s| s.attributes().iter().map(String::as_str).collect()).collect();
    assert_eq!(attributes, [vec!["major_class: animal", "motion_class: walking"], vec!["occlusion"]]);
}
