//! ONVIF over HTTPS: who is trusted, and that nobody else hears anything.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![cfg(all(feature = "onvif-tls", unix))]

mod common;

use common::{Heard, camera, camera_through, usual};
use pursuit_ptz::drivers::onvif::{Login, Onvif, OnvifParams, shown_certificate};
use pursuit_ptz::drivers::{Head, Password, Timeouts};
use pursuit_ptz::{Command, PtzError, Result};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ServerConfig, ServerConnection, StreamOwned};
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// A camera's own certificate without any name of a host, one by an authority for `localhost`, and that authority's.
struct Certificates(PathBuf);

impl Certificates {
    fn make(name: &str) -> Option<Self> {
        let folder = std::env::temp_dir().join(format!("pursuit-ptz-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let script = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=camera -keyout own.key -out own.pem && \
             openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=authority -keyout ca.key -out ca.pem && \
             openssl req -newkey rsa:2048 -nodes -subj /CN=localhost -keyout signed.key -out signed.csr && \
             printf subjectAltName=DNS:localhost > ext && \
             openssl x509 -req -in signed.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -extfile ext -out signed.pem";
        let made = std::process::Command::new("sh").args(["-c", script]).current_dir(&folder).output();
        if made.is_ok_and(|output| output.status.success()) {
            return Some(Self(folder));
        }
        println!("skipped: there is no openssl that makes certificates");
        None
    }

    fn pem(&self, name: &str) -> PathBuf {
        self.0.join(format!("{name}.pem"))
    }

    /// A camera that shows this certificate; its port, and what it hears.
    fn camera(&self, name: &str) -> (u16, Receiver<Heard>) {
        let chain = CertificateDer::pem_file_iter(self.pem(name)).unwrap().map(|c| c.unwrap()).collect();
        let key = PrivateKeyDer::from_pem_file(self.0.join(format!("{name}.key"))).unwrap();
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let config = ServerConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
        let config = Arc::new(config.with_no_client_auth().with_single_cert(chain, key).unwrap());
        let wrap = move |mut stream: TcpStream| {
            let mut connection = ServerConnection::new(config.clone()).unwrap();
            let agreed = connection.complete_io(&mut stream).is_ok() && !connection.is_handshaking();
            agreed.then(|| StreamOwned::new(connection, stream))
        };
        camera_through(wrap, |action, _, _| usual(action))
    }
}

impl Drop for Certificates {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

fn quick() -> Timeouts {
    Timeouts::from_secs(2.0, 2.0).unwrap()
}

fn connect(url: &str, certificates: Option<&Path>) -> Result<Onvif> {
    let login = Some(Login { user: "admin".into(), password: Password::new("sesame") });
    Onvif::connect(url, login, certificates, OnvifParams::default(), quick())
}

#[test]
fn a_cameras_own_certificate_is_trusted_by_its_file() {
    let Some(made) = Certificates::make("own") else { return };
    let (port, heard) = made.camera("own");
    let url = format!("https://127.0.0.1:{port}/onvif/device_service");
    let mut head = connect(&url, Some(&made.pem("own"))).unwrap();
    assert_eq!(head.name(), format!("onvifs://127.0.0.1:{port}"));
    head.send(&Command::Home).unwrap();
    drop(head);
    assert!(heard.try_iter().any(|(action, _, _)| action == "stop"));
}

#[test]
fn who_is_not_trusted_hears_nothing() {
    let Some(made) = Certificates::make("nobody") else { return };
    let (port, heard) = made.camera("own");
    for (host, certificates) in [("127.0.0.1", None), ("localhost", None), ("127.0.0.1", Some(made.pem("ca")))] {
        let error = connect(&format!("https://{host}:{port}/"), certificates.as_deref()).err().unwrap();
        let PtzError::Certificate { fingerprint, .. } = &error else { panic!("{error}") };
        assert_eq!(fingerprint.len(), 95);
        assert!(error.to_string().contains("--head-ca"), "{error}");
    }
    assert_eq!(heard.try_iter().count(), 0);
    let (pem, fingerprint) = shown_certificate("127.0.0.1", port, quick()).unwrap();
    assert_eq!(pem, std::fs::read_to_string(made.pem("own")).unwrap());
    assert_eq!(fingerprint.len(), 95);
}

#[test]
fn what_an_authority_signed_is_trusted_for_its_name() {
    let Some(made) = Certificates::make("signed") else { return };
    let (port, _heard) = made.camera("signed");
    let ca = made.pem("ca");
    connect(&format!("https://localhost:{port}/"), Some(&ca)).unwrap();
    let error = connect(&format!("https://127.0.0.1:{port}/"), Some(&ca)).err().unwrap();
    assert!(matches!(error, PtzError::Certificate { .. }), "{error}");
}

#[test]
fn plain_and_secret_ports_are_told_apart() {
    let (url, _heard) = camera(|action, _, _| usual(action));
    let error = connect(&url.replace("http:", "https:"), None).err().unwrap().to_string();
    assert!(error.contains("hung up") && error.contains("onvif://"), "{error}");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || listener.accept().unwrap().0.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n"));
    let error = connect(&format!("https://127.0.0.1:{port}/"), None).err().unwrap().to_string();
    assert!(error.contains("does not speak TLS"), "{error}");
    let Some(made) = Certificates::make("plain") else { return };
    let (port, _heard) = made.camera("own");
    let error = connect(&format!("http://127.0.0.1:{port}/"), None).err().unwrap().to_string();
    assert!(error.contains("onvifs://"), "{error}");
}

#[test]
fn keys_are_agreed_on_in_time_or_not() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            // The head of a long message of a handshake, and then a byte now and then.
            stream.write_all(&[22, 3, 3, 0x30, 0]).ok();
            while stream.write_all(&[2]).is_ok() {
                std::thread::sleep(Duration::from_millis(100));
            }
        }
    });
    let began = Instant::now();
    let error = connect(&format!("https://127.0.0.1:{port}/"), None).err().unwrap();
    assert!(matches!(error, PtzError::TimedOut { .. }), "{error}");
    assert!(began.elapsed() < Duration::from_secs(12), "{:?}", began.elapsed());
}
