//! TLS under the HTTP of a camera: who is trusted, and what certificate was shown.
//!
//! Most cameras show a certificate that they made themselves, for another name or for none. One that stands in the file of
//! trusted certificates is therefore trusted as it is; any other must be signed by an authority of that file, or of the system
//! where no file is given, and be for the camera's name.

use crate::drivers::Timeouts;
use crate::{PtzError, Result};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::crypto::{CryptoProvider, ring, verify_tls12_signature, verify_tls13_signature};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::{
    CertificateError, ClientConfig, ClientConnection, DigitallySignedStruct, RootCertStore, SignatureScheme,
    StreamOwned,
};
use sha2::{Digest, Sha256};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use ureq::unversioned::transport::{
    Buffers, ConnectionDetails, Connector, Either, LazyBuffers, NextTimeout, Transport, TransportAdapter,
};

/// Who is trusted.
#[derive(Debug)]
struct Trusted {
    /// These, as they are.
    themselves: Vec<CertificateDer<'static>>,
    /// What these have signed; `None` where there is no authority.
    authorities: Option<Arc<WebPkiServerVerifier>>,
    provider: Arc<CryptoProvider>,
    /// The certificate that was shown last.
    shown: Mutex<Option<CertificateDer<'static>>>,
}

impl ServerCertVerifier for Trusted {
    fn verify_server_cert(
        &self,
        shown: &CertificateDer<'_>,
        chain: &[CertificateDer<'_>],
        name: &ServerName<'_>,
        ocsp: &[u8],
        now: UnixTime,
    ) -> std::result::Result<ServerCertVerified, rustls::Error> {
        *self.shown.lock().unwrap_or_else(PoisonError::into_inner) = Some(shown.clone().into_owned());
        if self.themselves.contains(shown) {
            return Ok(ServerCertVerified::assertion());
        }
        match &self.authorities {
            Some(authorities) => authorities.verify_server_cert(shown, chain, name, ocsp, now),
            None => Err(CertificateError::UnknownIssuer.into()),
        }
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> std::result::Result<HandshakeSignatureValid, rustls::Error> {
        verify_tls12_signature(message, certificate, signed, &self.provider.signature_verification_algorithms)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> std::result::Result<HandshakeSignatureValid, rustls::Error> {
        verify_tls13_signature(message, certificate, signed, &self.provider.signature_verification_algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.provider.signature_verification_algorithms.supported_schemes()
    }
}

/// Speaks TLS over connections of `ureq`.
#[derive(Debug, Clone)]
pub(super) struct Tls {
    config: Arc<ClientConfig>,
    trusted: Arc<Trusted>,
}

impl Tls {
    /// Trusts the certificates of a PEM file, or the system's authorities.
    ///
    /// # Errors
    /// Where the file cannot be read or holds no certificate.
    pub fn new(certificates: Option<&Path>) -> Result<Self> {
        let themselves = certificates.map_or_else(|| Ok(Vec::new()), read)?;
        let mut roots = RootCertStore::empty();
        roots.add_parsable_certificates(match certificates {
            Some(_) => themselves.clone(),
            None => rustls_native_certs::load_native_certs().certs,
        });
        let provider = Arc::new(ring::default_provider());
        let authorities = WebPkiServerVerifier::builder_with_provider(Arc::new(roots), provider.clone()).build().ok();
        let trusted =
            Arc::new(Trusted { themselves, authorities, provider: provider.clone(), shown: Mutex::default() });
        let config = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
        let config = config.map_err(|error| PtzError::Address { reason: format!("this build has no TLS: {error}") })?;
        let config = config.dangerous().with_custom_certificate_verifier(trusted.clone()).with_no_client_auth();
        Ok(Self { config: Arc::new(config), trusted })
    }

    /// The certificate that was shown last, in PEM, and its fingerprint.
    pub fn shown(&self) -> Option<(String, String)> {
        let shown = self.trusted.shown.lock().unwrap_or_else(PoisonError::into_inner);
        shown.as_ref().map(|certificate| (written(certificate), fingerprint(certificate)))
    }
}

/// What went wrong where it is TLS that did.
pub(super) fn explained(error: &ureq::Error, tls: &Tls, head: &str, doing: &'static str) -> Option<PtzError> {
    let ureq::Error::Io(io) = error else { return None };
    let head = head.to_owned();
    Some(match io.get_ref()?.downcast_ref::<rustls::Error>()? {
        rustls::Error::InvalidCertificate(why) => {
            let fingerprint = tls.shown().map_or_else(String::new, |(_, fingerprint)| fingerprint);
            PtzError::Certificate { head, reason: in_words(why), fingerprint }
        }
        rustls::Error::InvalidMessage(_) => {
            let reason = "it does not speak TLS; a camera without it is reached by onvif://".to_owned();
            PtzError::Reply { head, doing, reason }
        }
        other => PtzError::Reply { head, doing, reason: format!("TLS failed: {other}") },
    })
}

fn in_words(why: &CertificateError) -> String {
    match why {
        CertificateError::UnknownIssuer => "no authority that is trusted has signed it".into(),
        CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. } => {
            "it is made out to another name".into()
        }
        CertificateError::Expired | CertificateError::ExpiredContext { .. } => "it has expired".into(),
        // What an authority signs others with, shown as the camera's: it made that itself.
        CertificateError::Other(_) => "the camera made it itself".into(),
        other => other.to_string(),
    }
}

/// The certificate that a server shows, in PEM, and its fingerprint: for people to compare. Nothing is trusted by it.
///
/// # Errors
/// Where the server cannot be reached in time or shows no certificate.
pub fn shown_certificate(host: &str, port: u16, timeouts: Timeouts) -> Result<(String, String)> {
    let head = || format!("onvifs://{host}:{port}");
    let io = |source| PtzError::Io { head: head(), doing: "asking for the certificate", source };
    let bare = host.trim_matches(['[', ']']);
    let address = (bare, port).to_socket_addrs().map_err(io)?.next();
    let address = address.ok_or_else(|| io(std::io::ErrorKind::AddrNotAvailable.into()))?;
    let mut socket = TcpStream::connect_timeout(&address, timeouts.connect).map_err(io)?;
    socket.set_read_timeout(Some(timeouts.answer)).map_err(io)?;
    socket.set_write_timeout(Some(timeouts.answer)).map_err(io)?;
    let name = ServerName::try_from(bare.to_owned());
    let name = name.map_err(|error| PtzError::Address { reason: format!("{bare} is no name of a server: {error}") })?;
    let tls = Tls::new(None)?;
    let unsound = |error: rustls::Error| io(std::io::Error::other(error));
    let ended = ClientConnection::new(tls.config.clone(), name).map_err(unsound)?.complete_io(&mut socket);
    match (tls.shown(), ended) {
        (Some(shown), _) => Ok(shown),
        (None, Err(source)) => Err(io(source)),
        (None, Ok(_)) => Err(io(std::io::ErrorKind::InvalidData.into())),
    }
}

fn read(path: &Path) -> Result<Vec<CertificateDer<'static>>> {
    let wrong = |why: String| PtzError::Address {
        reason: format!("no certificate can be read from {}: {why}", path.display()),
    };
    let found: std::result::Result<Vec<_>, _> =
        CertificateDer::pem_file_iter(path).map_err(|error| wrong(error.to_string()))?.collect();
    let found = found.map_err(|error| wrong(error.to_string()))?;
    if found.is_empty() {
        return Err(wrong("it has no `-----BEGIN CERTIFICATE-----`".into()));
    }
    Ok(found)
}

/// A certificate in PEM.
fn written(certificate: &CertificateDer<'_>) -> String {
    let text = STANDARD.encode(certificate.as_ref());
    // Base64 is ASCII, so any cut is between characters.
    let lines: Vec<&str> = text.as_bytes().chunks(64).filter_map(|line| std::str::from_utf8(line).ok()).collect();
    format!("-----BEGIN CERTIFICATE-----\n{}\n-----END CERTIFICATE-----\n", lines.join("\n"))
}

/// The SHA-256 of a certificate as tools show it: `AB:CD:…`.
fn fingerprint(certificate: &CertificateDer<'_>) -> String {
    let bytes = Sha256::digest(certificate.as_ref());
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(":")
}

impl<Under: Transport> Connector<Under> for Tls {
    type Out = Either<Under, TlsTransport>;

    fn connect(
        &self,
        details: &ConnectionDetails<'_>,
        under: Option<Under>,
    ) -> std::result::Result<Option<Self::Out>, ureq::Error> {
        let Some(under) = under else { return Ok(None) };
        if !details.needs_tls() || under.is_tls() {
            return Ok(Some(Either::A(under)));
        }
        let host = details.uri.host().unwrap_or_default().trim_matches(['[', ']']).to_owned();
        let name = ServerName::try_from(host).map_err(|_| ureq::Error::HostNotFound)?;
        let failed = |error| ureq::Error::Io(std::io::Error::other(error));
        let mut connection = ClientConnection::new(self.config.clone(), name).map_err(failed)?;
        let mut socket = TransportAdapter::new(under.boxed(), details.current_time.clone());
        shake_hands(&mut connection, &mut socket, details.timeout)?;
        let stream = StreamOwned::new(connection, socket);
        let buffers = LazyBuffers::new(details.config.input_buffer_size(), details.config.output_buffer_size());
        Ok(Some(Either::B(TlsTransport { buffers, stream })))
    }
}

/// Agrees on keys within the time that is left, however slowly the other side answers.
fn shake_hands(
    connection: &mut ClientConnection,
    socket: &mut TransportAdapter,
    left: NextTimeout,
) -> std::result::Result<(), ureq::Error> {
    let began = Instant::now();
    while connection.is_handshaking() {
        let after = left.after.saturating_sub(began.elapsed());
        if after.is_zero() {
            return Err(ureq::Error::Timeout(left.reason));
        }
        socket.set_timeout(NextTimeout { after: after.into(), ..left });
        if connection.wants_write() {
            connection.write_tls(socket)?;
            continue;
        }
        if connection.read_tls(socket)? == 0 {
            let why = "it hung up before TLS was agreed on; a camera without TLS is reached by onvif://";
            return Err(std::io::Error::new(std::io::ErrorKind::UnexpectedEof, why).into());
        }
        if let Err(error) = connection.process_new_packets() {
            // The other side is told why; whether it listens does not matter any more.
            connection.write_tls(socket).ok();
            return Err(std::io::Error::other(error).into());
        }
    }
    Ok(())
}

/// A connection through which TLS is spoken.
pub(super) struct TlsTransport {
    buffers: LazyBuffers,
    stream: StreamOwned<ClientConnection, TransportAdapter>,
}

impl std::fmt::Debug for TlsTransport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("TlsTransport").field(self.stream.sock.inner()).finish()
    }
}

impl Transport for TlsTransport {
    fn buffers(&mut self) -> &mut dyn Buffers {
        &mut self.buffers
    }

    fn transmit_output(&mut self, amount: usize, timeout: NextTimeout) -> std::result::Result<(), ureq::Error> {
        use std::io::Write;
        self.stream.sock.set_timeout(timeout);
        let output = self.buffers.output().get(..amount).unwrap_or_default();
        Ok(self.stream.write_all(output)?)
    }

    fn await_input(&mut self, timeout: NextTimeout) -> std::result::Result<bool, ureq::Error> {
        use std::io::Read;
        self.stream.sock.set_timeout(timeout);
        let amount = self.stream.read(self.buffers.input_append_buf())?;
        self.buffers.input_appended(amount);
        Ok(amount > 0)
    }

    fn is_open(&mut self) -> bool {
        self.stream.sock.get_mut().is_open()
    }

    fn is_tls(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_certificate_is_written_as_it_is_read() {
        let bytes: Vec<u8> = (0..=200).collect();
        let certificate = CertificateDer::from(bytes);
        let path = std::env::temp_dir().join(format!("pursuit-ptz-{}.pem", std::process::id()));
        std::fs::write(&path, written(&certificate)).unwrap();
        assert_eq!(read(&path).unwrap(), vec![certificate]);
        std::fs::write(&path, "nothing").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("BEGIN CERTIFICATE"));
        std::fs::remove_file(&path).unwrap();
        assert!(read(&path).is_err());
        assert!(fingerprint(&CertificateDer::from(b"abc".to_vec())).starts_with("BA:78:16:BF:8F:01:CF:EA:41:41:40"));
    }
}
