//! A network of one picture; and what fits neither.

use super::*;

/// What is red enough in the cells of a picture of 48 x 32: 12 x 8 logits, and what is made of them.
fn plain(make: impl Fn(NetworkFile) -> NetworkFile) -> NetworkFile {
    let weights: Vec<f32> = (0..3 * 16).map(|k| RED[k / 16] / 16.0).collect();
    let file = NetworkFile::default()
        .floats("weights", &[1, 3, 4, 4], &weights)
        .floats("enough", &[], &[ENOUGH as f32])
        .floats("nothing", &[], &[f32::NAN])
        .floats("zero", &[], &[0.0]);
    make(file)
}

fn logits(file: NetworkFile) -> NetworkFile {
    file.input("input", &[0, 3, 0, 0]).cells("input", "weights", "red", 4).node(
        "Sub",
        &["red", "enough"],
        "logits",
        &[],
    )
}

#[test]
fn a_network_of_one_picture_draws_the_region_that_it_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("net.onnx");
    let small = "image_px = [48, 32]\n";
    let variants: [(&str, NetworkFile, String); 6] = [
        ("logits", plain(|f| logits(f).output("logits", 4)), small.into()),
        (
            "probabilities",
            plain(|f| logits(f).node("Sigmoid", &["logits"], "mask", &[]).output("mask", 4)),
            small.into(),
        ),
        (
            "two planes",
            plain(|f| {
                logits(f)
                    .node("Neg", &["logits"], "ground", &[])
                    .node("Concat", &["ground", "logits"], "both", &[("axis", 1)])
                    .output("both", 4)
            }),
            small.into(),
        ),
        (
            "three planes, the target's first, pixel by pixel",
            plain(|f| {
                logits(f)
                    .node("Neg", &["logits"], "ground", &[])
                    .node("Sub", &["ground", "enough"], "else", &[])
                    .node("Concat", &["logits", "ground", "else"], "planes", &[("axis", 1)])
                    .listed("Transpose", &["planes"], "pixels", &[("perm", &[0, 2, 3, 1])])
                    .output("pixels", 4)
            }),
            format!("{small}plane = 0"),
        ),
        (
            "pixels in, no batch, nothing of its own but a mask of two axes",
            plain(|f| {
                let normal = f
                    .input("input", &[32, 48, 3])
                    .floats("mean", &[3], &MEAN.map(|v| v as f32))
                    .floats("deviation", &[3], &DEVIATION.map(|v| v as f32))
                    .wholes("batch", &[0])
                    .wholes("ones", &[0, 1])
                    .node("Sub", &["input", "mean"], "less", &[])
                    .node("Div", &["less", "deviation"], "normal", &[])
                    .node("Unsqueeze", &["normal", "batch"], "one", &[])
                    .listed("Transpose", &["one"], "planes", &[("perm", &[0, 3, 1, 2])])
                    .cells("planes", "weights", "red", 4);
                let logits = normal.node("Sub", &["red", "enough"], "logits", &[]);
                logits.node("Squeeze", &["logits", "ones"], "mask", &[]).output("mask", 2)
            }),
            String::new(),
        ),
        (
            "blue before red, said so",
            NetworkFile::default()
                .input("input", &[1, 3, 32, 48])
                .floats("weights", &[1, 3, 4, 4], &(0..48).map(|k| RED[2 - k / 16] / 16.0).collect::<Vec<_>>())
                .floats("enough", &[], &[ENOUGH as f32])
                .cells("input", "weights", "red", 4)
                .node("Sub", &["red", "enough"], "logits", &[])
                .output("logits", 4),
            "channels = 'bgr'\nmean = [103.53, 116.28, 123.675]\ndeviation = [57.375, 57.12, 58.395]".into(),
        ),
    ];
    let image = frame(90, 70, (50.0, 33.0, 15.0));
    for (what, network, toml) in &variants {
        std::fs::write(&file, network.to_bytes()).unwrap();
        std::fs::write(folder.path().join("net.toml"), toml).unwrap();
        for way in ways() {
            let mut network = SegmentationNetwork::open(&file, &way).unwrap();
            let words = network.taken_for();
            assert!(words.contains("48 x 32") && words.contains("12 x 8"), "{what}: {words}");
            for (x, y) in [(36.0, 19.0), (80.0, 60.0), (-8.0, 50.0)] {
                let bbox = BBox::from_ltwh(x, y, 28.0, 28.0);
                // A quarter of the box at each side, beyond the frame too, stretched over the picture.
                let window = [x as i64 - 7, y as i64 - 7, 42, 42];
                let shown = resized(&image, window, (48, 32));
                let cell = |i: usize, j: usize| {
                    let of = |k: usize| redness(shown[(4 * j + k / 4) * 48 + 4 * i + k % 4]);
                    (0..16).map(of).sum::<f64>() / 16.0 - ENOUGH
                };
                let found = segmented(&mut network, &image, &bbox);
                let (mut off, mut set) = (0, 0);
                for (k, is) in found.iter().enumerate() {
                    let (px, py) = ((k % 90) as f64 + 0.5, (k / 90) as f64 + 0.5);
                    let (u, v) = ((px - window[0] as f64) / 42.0 * 12.0, (py - window[1] as f64) / 42.0 * 8.0);
                    if !((0.0..12.0).contains(&u) && (0.0..8.0).contains(&v)) {
                        assert!(!is, "{what}: beyond what was shown");
                        continue;
                    }
                    // A probability between cells crosses one half elsewhere than its logit crosses 0.
                    let squashed = |i: usize, j: usize| 1.0 / (1.0 + (-cell(i, j)).exp()) - 0.5;
                    let said = match *what {
                        "probabilities" => between(&squashed, (12, 8), u, v),
                        _ => between(&cell, (12, 8), u, v),
                    };
                    off += usize::from(said.abs() > 0.03 && *is != (said > 0.0));
                    set += usize::from(*is);
                }
                assert_eq!(off, 0, "{what} at {x}, {y}");
                assert!(x != 36.0 || (500..900).contains(&set), "{what}: {set}");
            }
        }
    }
}

#[test]
fn what_is_no_number_is_nobodys() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("net.onnx");
    let broken = plain(|f| logits(f).node("Mul", &["logits", "nothing"], "mask", &[]).output("mask", 4));
    std::fs::write(&file, broken.to_bytes()).unwrap();
    std::fs::write(folder.path().join("net.toml"), "image_px = [48, 32]\nvalues = 'logits'").unwrap();
    let image = frame(90, 70, (50.0, 33.0, 15.0));
    for way in ways() {
        let mut network = SegmentationNetwork::open(&file, &way).unwrap();
        let found = segmented(&mut network, &image, &BBox::from_ltwh(36.0, 19.0, 28.0, 28.0));
        assert!(found.len() == 90 * 70 && found.iter().all(|is| !is));
    }
}

#[test]
fn answers_that_are_no_probabilities_after_all_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("net.onnx");
    // From 0 to 1 on whatever a picture of mean and noise makes, and beyond on plain red.
    let steep = plain(|f| {
        f.input("input", &[1, 3, 32, 48])
            .cells("input", "weights", "red", 4)
            .floats("shift", &[], &[-1.7])
            .node("Add", &["red", "shift"], "less", &[])
            .node("Relu", &["less"], "some", &[])
            .floats("ten", &[], &[10.0])
            .node("Mul", &["some", "ten"], "mask", &[])
            .output("mask", 4)
    });
    std::fs::write(&file, steep.to_bytes()).unwrap();
    let image = frame(90, 70, (50.0, 33.0, 15.0));
    let bbox = BBox::from_ltwh(36.0, 19.0, 28.0, 28.0);
    for way in ways() {
        let mut network = SegmentationNetwork::open(&file, &way).unwrap();
        assert!(network.taken_for().contains("probabilities"));
        let error = network.segment(image.view(), &bbox, (0..90, 0..70), &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains("values = \"logits\"") && error.contains("net.toml"), "{error}");
    }
    std::fs::write(folder.path().join("net.toml"), "values = 'logits'").unwrap();
    for way in ways() {
        let mut network = SegmentationNetwork::open(&file, &way).unwrap();
        assert!(segmented(&mut network, &image, &bbox).iter().any(|is| *is));
    }
}

#[test]
fn what_does_not_fit_is_refused_with_what_would() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let refused = |model: &Path, words: &[&str]| {
        for way in ways() {
            let error = SegmentationNetwork::open(model, &way).err().unwrap().to_string();
            words.iter().for_each(|w| assert!(error.contains(w), "{w}: {error}"));
        }
    };
    let of = |network: NetworkFile, toml: &str, words: &[&str]| {
        std::fs::write(at("net.onnx"), network.to_bytes()).unwrap();
        std::fs::write(at("net.toml"), toml).unwrap();
        refused(&at("net.onnx"), words);
    };
    refused(&at("nowhere.onnx"), &["nowhere.onnx", "cannot be read"]);
    refused(&at("nowhere.toml"), &["nowhere.toml", "cannot be read"]);
    of(encoder(), "", &["3 planes", "`plane = …`"]);
    let two = NetworkFile::default().input("a", &[1, 3, 8, 8]).input("b", &[1, 3, 8, 8]);
    of(two.node("Add", &["a", "b"], "c", &[]).output("c", 4), "", &["2 inputs"]);
    let grey = NetworkFile::default().input("a", &[1, 1, 8, 8]).node("Relu", &["a"], "b", &[]).output("b", 4);
    of(grey, "", &["`a` is no picture of three channels"]);
    let number =
        |f: NetworkFile| logits(f).node("ReduceMax", &["logits"], "most", &[("keepdims", 0)]).output("most", 0);
    of(plain(number), "image_px = [48, 32]", &["no mask of the picture"]);
    let three =
        |f: NetworkFile| logits(f).node("Concat", &["logits", "logits", "logits"], "c", &[("axis", 1)]).output("c", 4);
    of(plain(three), "image_px = [48, 32]", &["3 planes", "`plane = …`"]);
    of(plain(three), "image_px = [48, 32]\nplane = 3", &["none is 3"]);
    of(plain(three), "image_pix = [48, 32]", &["net.toml", "image_pix"]);
    of(plain(three), "deviation = [0.0, 1.0, 1.0]", &["net.toml", "deviation"]);
    of(plain(three), "encoder = 'a.onnx'\ndecoder = 'b.onnx'", &["net.toml", "name this description"]);
    of(plain(three), "encoder = 'a.onnx'", &["net.toml", "two names"]);
    of(plain(three), "image_px = [48", &["net.toml", "line 1"]);
    std::fs::write(at("pair.toml"), "context = 1.0").unwrap();
    refused(&at("pair.toml"), &["pair.toml", "names no `encoder`"]);

    let both = folder.path().join("both");
    std::fs::create_dir(&both).unwrap();
    refused(&both, &["0 ONNX files with `encoder`", "0 with `decoder`", "TOML"]);
    let pair = |encoder: &NetworkFile, decoder: &NetworkFile, words: &[&str]| {
        std::fs::write(both.join("encoder.onnx"), encoder.to_bytes()).unwrap();
        std::fs::write(both.join("decoder.onnx"), decoder.to_bytes()).unwrap();
        refused(&both, words);
    };
    let good = decoder([0.1, 0.2, 0.3]);
    let wide = NetworkFile::default().input("image", &[1, 3, 32, 64]).floats("weights", &[3, 3, 8, 8], &means(3, 8));
    let wide = wide.cells("image", "weights", "image_embeddings", 8).output("image_embeddings", 4);
    pair(&wide, &good, &["`image_embeddings` is 1 x 3 x 8 x 8, where [1, 3, 4, 8]", "decoder.onnx"]);
    let coarse =
        NetworkFile::default().input("image", &[1, 3, 64, 64]).floats("weights", &[3, 3, 16, 16], &means(3, 16));
    let coarse = coarse.cells("image", "weights", "image_embeddings", 16).output("image_embeddings", 4);
    pair(&coarse, &good, &["where [1, 3, 4, 4] is given"]);
    pair(&encoder(), &encoder(), &["no input `image_embeddings`, but `image`", "point_coords"]);
    let small = || {
        NetworkFile::default()
            .input("image_embeddings", &[1, 3, 8, 8])
            .input("point_coords", &[1, 0, 2])
            .input("point_labels", &[1, 0])
            .node("ReduceMax", &["point_coords"], "far", &[("keepdims", 0)])
            .node("ReduceMax", &["point_labels"], "most", &[("keepdims", 0)])
            .node("Add", &["far", "most"], "sum", &[])
            .node("Add", &["image_embeddings", "sum"], "masks", &[])
    };
    pair(&encoder(), &small().output("masks", 4), &["3 masks", "how good"]);
    pair(&encoder(), &small().node("Relu", &["masks"], "what", &[]).output("what", 4), &["`what`", "low_res_masks"]);
    let any = small().node("Shape", &["masks"], "shape", &[]).node("ConstantOfShape", &["shape"], "zeros", &[]);
    pair(&encoder(), &any.output("zeros", 4), &["operator `ConstantOfShape`", "onnxsim", "point_coords:1,2,2"]);
    pair(&encoder(), &small().input("prompt", &[1]).output("masks", 4), &["`prompt` that is not known"]);
    std::fs::write(both.join("a_decoder.onnx"), good.to_bytes()).unwrap();
    refused(&both, &["1 ONNX files with `encoder`", "2 with `decoder`"]);
    let toml = "encoder = 'encoder.onnx'\ndecoder = 'a_decoder.onnx'\n";
    std::fs::write(both.join("mine.toml"), format!("{toml}plane = 1")).unwrap();
    refused(&both.join("mine.toml"), &["`plane` is of networks of one picture"]);
    std::fs::write(both.join("mine.toml"), toml).unwrap();
    for way in ways() {
        assert!(SegmentationNetwork::open(&both.join("mine.toml"), &way).is_ok());
    }
}
