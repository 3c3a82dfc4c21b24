//! The page: whole, alone, and safe with any name.
#![allow(clippy::unwrap_used)]

mod common;
use common::{Scripted, write, write_images};
use pursuit_evaluation::{EvalOptions, Protocol, evaluate};
use pursuit_tracking::TrackState::Tracking;
use std::path::Path;
use std::sync::atomic::AtomicBool;

const EVIL: &str = "<script>alert('x')&\"";

fn page(root: &Path, protocol: Protocol) -> String {
    let folder = root.join("data").join("one & <two>");
    let images = write_images(&folder, 30, 1, 4);
    let line = |(i, n): (usize, &String)| {
        let bbox = if (10..14).contains(&i) { "nan,nan,nan,nan" } else { "2,3,4,5" };
        format!("{i},{n},{bbox}\n")
    };
    write(
        &folder.join("frames.csv"),
        &("index,image,x,y,w,h\n".to_owned() + &images.iter().enumerate().map(line).collect::<String>()),
    );
    write(&root.join("data/bad/groundtruth.txt"), "1,2,3\n");
    let moving = Scripted::new(EVIL, |frame, first| Some((first.translated((frame % 7) as f64, 0.0), Tracking, 0.5)));
    let failing = Scripted::new("failing", |frame, first| (frame < 20).then_some((first, Tracking, 0.9)));
    let trackers = vec![Scripted::still().entry(), moving.entry(), failing.entry()];
    let mut options = EvalOptions::new(vec![root.join("data")], trackers, root.join("out"));
    options.protocol = protocol;
    evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap();
    std::fs::read_to_string(root.join("out/report.html")).unwrap()
}

/// Every element closed in order, every attribute quoted; the text of `<script>` and `<style>` is passed over.
fn check_nesting(page: &str) -> usize {
    let mut open: Vec<String> = Vec::new();
    let mut rest = page.strip_prefix("<!DOCTYPE html>").unwrap();
    let mut elements = 0;
    while let Some(start) = rest.find('<') {
        assert!(!rest[..start].contains('>'), "a stray > before {}", &rest[start..(start + 60).min(rest.len())]);
        let mut quoted = false;
        let end = rest[start..].find(|c: char| {
            quoted ^= c == '"';
            c == '>' && !quoted
        });
        let tag = &rest[start + 1..start + end.unwrap()];
        rest = &rest[start + tag.len() + 2..];
        assert!(!tag.contains('<'), "an unescaped < in {tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
        } else {
            elements += 1;
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");

            let name = tag.split([' ', '/', '\n']).next().unwrap().to_owned();
            if name == "script" || name == "style" {
                let close = format!("</{name}>");
                rest = &rest[rest.find(&close).unwrap() + close.len()..];
            } else if !tag.ends_with('/') {
                open.push(name);
            }
        }
    }
    assert!(open.is_empty(), "{open:?}");
    elements
}

#[test]
fn the_page_is_whole_alone_and_escaped() {
    for protocol in [Protocol::Ope, Protocol::Reset] {
        let root = tempfile::tempdir().unwrap();
        let page = page(root.path(), protocol);
        assert!(check_nesting(&page) > 200);
        assert!(!page.contains(EVIL) && page.contains("&lt;script&gt;alert(&#39;x&#39;)&amp;&quot;"));
        assert!(page.contains("one &amp; &lt;two&gt;") && !page.contains("one & <two>"));
        for outside in ["http:", "https:", "src=", "@import", "url("] {
            assert!(!page.contains(outside), "{outside} reaches out of the file");
        }
        assert!(page.contains("data:image/jpeg;base64,/9j/"), "worst frames are shown");
        assert!(page.contains("class=\"away\""), "absences are shaded");
        assert!(page.contains("bad/groundtruth.txt:1"), "what was left out is said");
        assert!(page.contains("frame 20: tracker `scripted` needs a script"), "a tracker's error is shown");
        assert_eq!(page.contains("Expected average overlap"), protocol == Protocol::Reset);
    }
}

#[test]
fn pictures_can_be_left_out() {
    let root = tempfile::tempdir().unwrap();
    page(root.path(), Protocol::Ope);
    let still = vec![Scripted::still().entry()];
    let mut options = EvalOptions::new(vec![root.path().join("data")], still, root.path().join("out"));
    options.thumbnails = false;
    evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap();
    let page = std::fs::read_to_string(root.path().join("out/report.html")).unwrap();
    assert!(!page.contains("data:image") && check_nesting(&page) > 100);
}
