use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Studio {
    /// The input to open: as for `pursuit track`; without, one is chosen in the page
    #[arg(value_name = "INPUT")]
    pub input: Option<OsString>,
    /// Port to listen at (0: any that is free)
    #[arg(long, default_value_t = 7400, value_name = "N")]
    pub port: u16,
    /// Address to listen at; anything but the loopback makes a token necessary, which is in the address printed
    #[arg(long, default_value = "127.0.0.1", value_name = "ADDR")]
    pub host: String,
    /// Folder that files named in the page must lie in, symbolic links resolved
    #[arg(long, default_value = ".", value_name = "DIR")]
    pub root: PathBuf,
    /// Open no browser
    #[arg(long)]
    pub no_open: bool,
}
