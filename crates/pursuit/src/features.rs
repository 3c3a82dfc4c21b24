/// The optional parts of this crate, and whether this build has them.
pub const FEATURES: [(&str, bool); 14] = [
    ("encode", cfg!(feature = "encode")),
    ("h264", cfg!(feature = "h264")),
    ("mqtt", cfg!(feature = "mqtt")),
    ("mqtts", cfg!(feature = "mqtts")),
    ("nats", cfg!(feature = "nats")),
    ("tls", cfg!(feature = "tls")),
    ("parquet", cfg!(feature = "parquet")),
    ("xlsx", cfg!(feature = "xlsx")),
    ("ptz", cfg!(feature = "ptz")),
    ("mavlink", cfg!(feature = "mavlink")),
    ("mcap", cfg!(feature = "mcap")),
    ("db3", cfg!(feature = "db3")),
    ("onnxruntime", cfg!(feature = "onnxruntime")),
    ("rten", cfg!(feature = "rten")),
];

/// Why this build writes no overlay video, and what would mend it; `None` where it does.
pub const NO_OVERLAY: Option<&str> = if cfg!(feature = "encode") {
    None
} else {
    Some("this build has no video encoder and writes no overlay; build with `--features encode` (needs a C++ compiler)")
};
