//! The description of the calls and the calls that there are.

use crate::common::studio;
use serde_json::{Value, json};
use std::collections::BTreeSet;

const METHODS: [&str; 5] = ["get", "post", "put", "delete", "patch"];

/// Method and path of every call that the description has.
fn described() -> BTreeSet<(String, String)> {
    let description: Value = serde_json::from_str(include_str!("../../src/api/openapi.json")).unwrap();
    let paths = description["paths"].as_object().unwrap().iter();
    let calls = paths.flat_map(|(path, calls)| {
        let methods = METHODS.into_iter().filter(|method| calls.get(*method).is_some());
        methods.map(|method| (method.to_owned(), path.clone()))
    });
    calls.collect()
}

/// The same of the router, as its source builds it: axum does not tell which routes it has.
fn routed() -> BTreeSet<(String, String)> {
    let mut prefix = "";
    let mut calls = BTreeSet::new();
    for line in include_str!("../../src/api/mod.rs").lines() {
        prefix = match line.trim() {
            "let trial = Router::new()" => "/api/trials/{trial}",
            "let api = Router::new()" => "/api",
            "Router::new()" => "",
            _ => prefix,
        };
        let Some((path, answers)) = line.trim().strip_prefix(".route(\"").and_then(|l| l.split_once('"')) else {
            continue;
        };
        let whole = format!("{prefix}{path}");
        let path = if path == "/" && !prefix.is_empty() { prefix.to_owned() } else { whole };
        let methods = METHODS.into_iter().filter(|m| [" ", "."].iter().any(|b| answers.contains(&format!("{b}{m}("))));
        calls.extend(methods.map(|method| (method.to_owned(), path.clone())));
    }
    calls
}

#[test]
fn every_route_is_described() {
    assert!(described().len() > 20);
    assert_eq!(routed(), described());
}

#[test]
fn every_described_call_answers() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:drift?duration=1", "tracker": "mosse" }));
    let mut calls: Vec<_> = described().into_iter().collect();
    // What closes the trial comes last.
    calls.sort_by_key(|(method, path)| method == "delete" && path.ends_with("{trial}"));
    for (method, path) in calls {
        let at = path.replace("/api/trials/{trial}", &trial).replace("{target}", "1").replace("{name}", "app.js");
        let answer = studio.send(&method.to_uppercase(), &at, &json!({}));
        let is_missing = answer.status == 405 || answer.status == 404 && answer.body.is_empty();
        assert!(!is_missing && answer.status < 500 && answer.status != 0, "{method} {path}: {}", answer.status);
    }
}
