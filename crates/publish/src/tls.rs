//! TLS by rustls with ring.

use crate::{PublishError, Result};
use std::io;
use std::path::Path;
use std::sync::Arc;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::CertificateDer;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::{self, ClientConfig, RootCertStore};

/// One that trusts the certificates of a PEM file, or the system's.
pub(crate) fn client_config(ca_file: Option<&Path>) -> Result<ClientConfig> {
    let roots = match ca_file {
        Some(path) => of_file(path)?,
        None => of_system()?,
    };
    let config =
        ClientConfig::builder_with_provider(Arc::new(ring::default_provider())).with_safe_default_protocol_versions();
    let config = config.map_err(|e| certificates(Path::new("this build"), e.to_string()))?;
    Ok(config.with_root_certificates(roots).with_no_client_auth())
}

fn certificates(path: &Path, reason: String) -> PublishError {
    PublishError::Certificates { path: path.to_path_buf(), reason }
}

fn of_file(path: &Path) -> Result<RootCertStore> {
    let wrong = |reason: String| certificates(path, reason);
    let mut roots = RootCertStore::empty();
    for certificate in CertificateDer::pem_file_iter(path).map_err(|e| wrong(e.to_string()))? {
        let certificate = certificate.map_err(|e| wrong(e.to_string()))?;
        roots.add(certificate).map_err(|e| wrong(e.to_string()))?;
    }
    if roots.is_empty() {
        return Err(wrong("there is none; give a PEM file with `-----BEGIN CERTIFICATE-----`".to_owned()));
    }
    Ok(roots)
}

fn of_system() -> Result<RootCertStore> {
    let mut roots = RootCertStore::empty();
    roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
    if roots.is_empty() {
        let reason = "there is none; name the file of the broker's authority, or install `ca-certificates`".to_owned();
        return Err(certificates(Path::new("this system"), reason));
    }
    Ok(roots)
}

/// What went wrong, in words, and whether trying again is of no use.
pub(crate) fn explain(error: &rustls::Error) -> (String, bool) {
    match error {
        rustls::Error::InvalidCertificate(why) => {
            (format!("the broker's certificate is not to be trusted ({why}); name the file of its authority"), true)
        }
        rustls::Error::InvalidMessage(_) => ("what answers there does not speak TLS".to_owned(), false),
        error => (error.to_string(), false),
    }
}

/// The same of an error of a stream, behind which may be one of TLS.
pub(crate) fn explain_io(error: &io::Error) -> (String, bool) {
    match error.get_ref().and_then(|inner| inner.downcast_ref::<rustls::Error>()) {
        Some(error) => explain(error),
        None => (error.to_string(), false),
    }
}
