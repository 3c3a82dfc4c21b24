//! TLS by rustls with ring.

use crate::{PublishError, Result};
use rumqttc::{TlsConfiguration, TlsError, Transport};
use std::path::Path;
use std::sync::Arc;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::CertificateDer;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::{self, ClientConfig, RootCertStore};

/// A transport that trusts the certificates of a PEM file, or the system's.
pub(crate) fn transport(ca_file: Option<&Path>) -> Result<Transport> {
    let roots = match ca_file {
        Some(path) => of_file(path)?,
        None => of_system()?,
    };
    let config =
        ClientConfig::builder_with_provider(Arc::new(ring::default_provider())).with_safe_default_protocol_versions();
    let config = config.map_err(|e| certificates(Path::new("this build"), e.to_string()))?;
    let config = config.with_root_certificates(roots).with_no_client_auth();
    Ok(Transport::tls_with_config(TlsConfiguration::Rustls(Arc::new(config))))
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
pub(crate) fn explain(error: &TlsError) -> (String, bool) {
    let of_rustls = match error {
        TlsError::TLS(error) => Some(error),
        TlsError::Io(io) => io.get_ref().and_then(|inner| inner.downcast_ref::<rustls::Error>()),
        _ => None,
    };
    match of_rustls {
        Some(rustls::Error::InvalidCertificate(why)) => {
            (format!("the broker's certificate is not to be trusted ({why}); name the file of its authority"), true)
        }
        Some(rustls::Error::InvalidMessage(_)) => ("what answers there does not speak TLS".to_owned(), false),
        Some(error) => (error.to_string(), false),
        None => match error {
            TlsError::Io(io) => (io.to_string(), false),
            TlsError::DNSName(_) => ("the broker's name is none that a certificate can have".to_owned(), true),
            other => (other.to_string(), false),
        },
    }
}
