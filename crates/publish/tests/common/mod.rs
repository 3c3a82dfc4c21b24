//! A real broker, Mosquitto, and an independent listener, `mosquitto_sub`; the same of NATS in `nats`.
#![allow(dead_code, missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "helpers of tests")]

pub mod nats;

#[cfg(unix)]
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Where a listener is called until it hears it.
const CALL: &str = "listener";
/// For how long something that must happen is waited for.
const PATIENCE: Duration = Duration::from_secs(60);

/// Stops a program where it is, or lets it go on. On a busy machine a thread of it may run for a while after the signal:
/// it has stopped when this returns.
#[cfg(unix)]
fn hang(child: &Child, is_hung: bool) {
    let pid = Pid::from_child(child);
    kill_process(pid, if is_hung { Signal::STOP } else { Signal::CONT }).unwrap();
    if is_hung {
        let (_, status) = waitpid(Some(pid), WaitOptions::UNTRACED).unwrap().unwrap();
        assert!(status.stopped(), "{status:?}");
    }
}

pub fn free_port() -> u16 {
    TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port()
}

/// Where a program of a broker is; brokers are not on every user's path.
#[allow(clippy::disallowed_methods, reason = "a test looks for programs")]
fn program(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(["/usr/sbin".into(), "/usr/bin".into(), "/usr/local/sbin".into()]);
    folders.map(|folder| folder.join(name)).find(|file| file.is_file())
}

pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < PATIENCE, "never came: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A broker on a port of its own, which remembers nothing when it is killed.
pub struct Mosquitto {
    folder: tempfile::TempDir,
    pub port: u16,
    child: Option<Child>,
}

impl Mosquitto {
    /// None where Mosquitto is not installed, which is said. `settings` are lines of its configuration, made with the folder
    /// that it lies in.
    pub fn start(settings: impl FnOnce(&Path) -> String) -> Option<Self> {
        if program("mosquitto").is_none() || program("mosquitto_sub").is_none() {
            println!("skipped: there is no Mosquitto; install `mosquitto` and `mosquitto-clients`");
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let port = free_port();
        let own = settings(folder.path());
        let text = format!("listener {port} 127.0.0.1\nuser root\npersistence false\n{own}\n");
        std::fs::write(folder.path().join("broker.conf"), text).unwrap();
        let mut broker = Self { folder, port, child: None };
        broker.again();
        Some(broker)
    }

    pub fn open() -> Option<Self> {
        Self::start(|_| "allow_anonymous true".to_owned())
    }

    /// One that knows the user `me` with the password `sesame`.
    pub fn with_password() -> Option<Self> {
        Self::start(|folder| {
            let file = folder.join("passwords");
            let mut made = Command::new(program("mosquitto_passwd").unwrap());
            made.args(["-b", "-c"]).arg(&file).args(["me", "sesame"]);
            let made = made_quietly(&mut made);
            assert!(made.status().unwrap().success());
            format!("allow_anonymous false\npassword_file {}", file.display())
        })
    }

    pub fn again(&mut self) {
        let mut command = Command::new(program("mosquitto").unwrap());
        command.arg("-c").arg(self.folder.path().join("broker.conf"));
        self.child = Some(made_quietly(&mut command).spawn().unwrap());
        let port = self.port;
        wait_until("the broker", || TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_ok());
    }

    /// Leaves a retained message, as somebody else.
    pub fn leave(&self, topic: &str, payload: &str) {
        let mut command = Command::new(program("mosquitto_pub").unwrap());
        let own = ["-h", "127.0.0.1", "-p", &self.port.to_string(), "-q", "1", "-r", "-t", topic, "-m", payload];
        assert!(made_quietly(command.args(own)).status().unwrap().success());
    }

    pub fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    /// Stops it where it is, or lets it go on: its connections stay, and nothing answers.
    #[cfg(unix)]
    pub fn hang(&self, is_hung: bool) {
        self.child.iter().for_each(|child| hang(child, is_hung));
    }

    /// A listener to everything, which comes back when the broker does. It listens when this returns.
    pub fn listen(&self, arguments: &[&str]) -> Listener {
        let client = |name: &str, own: &[&str]| {
            let mut command = Command::new(program(name).unwrap());
            made_quietly(&mut command)
                .args(["-h", "127.0.0.1", "-p", &self.port.to_string()])
                .args(own)
                .args(arguments);
            command
        };
        let mut listener = client("mosquitto_sub", &["-q", "2", "-t", "#", "-F", "%r %t %x"]);
        let mut child = listener.stdout(Stdio::piped()).spawn().unwrap();
        let heard: Arc<Mutex<Vec<Heard>>> = Arc::default();
        let is_there = Arc::new(AtomicBool::new(false));
        let (lines, all, hears) =
            (BufReader::new(child.stdout.take().unwrap()).lines(), heard.clone(), is_there.clone());
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                let mut words = line.splitn(3, ' ').map(str::to_owned);
                let (is_old, topic) = (words.next().as_deref() == Some("1"), words.next().unwrap_or_default());
                if topic == CALL {
                    hears.store(true, Ordering::SeqCst);
                } else {
                    all.lock().unwrap().push(Heard {
                        is_old,
                        topic,
                        payload: from_hex(&words.next().unwrap_or_default()),
                    });
                }
            }
        });
        wait_until("the listener", || {
            let _ = client("mosquitto_pub", &["-t", CALL, "-m", "?"]).status();
            is_there.load(Ordering::SeqCst)
        });
        let stop = move || {
            let _ = child.kill();
            let _ = child.wait();
        };
        Listener { stop: Box::new(stop), heard }
    }
}

/// The text whose bytes these digits are; what is no text, a picture say, is shown as it may be.
fn from_hex(digits: &str) -> String {
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    String::from_utf8_lossy(&digits.as_bytes().chunks(2).map(byte).collect::<Vec<u8>>()).into_owned()
}

/// A way to a port that can be shut: connections are cut and none come about while it is.
pub struct Gate {
    pub port: u16,
    is_open: Arc<AtomicBool>,
}

impl Gate {
    pub fn to(target: u16) -> Self {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let (port, is_open) = (listener.local_addr().unwrap().port(), Arc::new(AtomicBool::new(true)));
        let open = is_open.clone();
        std::thread::spawn(move || {
            for client in listener.incoming().flatten() {
                let Ok(server) = TcpStream::connect((Ipv4Addr::LOCALHOST, target)) else { continue };
                let ways = [(client.try_clone(), server.try_clone()), (Ok(server), Ok(client))];
                for (from, to) in ways.map(|(from, to)| (from.unwrap(), to.unwrap())) {
                    let open = open.clone();
                    std::thread::spawn(move || carry(from, to, &open));
                }
            }
        });
        Self { port, is_open }
    }

    pub fn set_open(&self, is_open: bool) {
        self.is_open.store(is_open, Ordering::SeqCst);
    }
}

fn carry(mut from: TcpStream, mut to: TcpStream, is_open: &AtomicBool) {
    from.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    let mut bytes = [0; 4096];
    while is_open.load(Ordering::SeqCst) {
        match from.read(&mut bytes) {
            Ok(0) => break,
            Ok(read) if to.write_all(&bytes[..read]).is_err() => break,
            Err(e) if !matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => break,
            _ => {}
        }
    }
    let _ = from.shutdown(Shutdown::Both);
    let _ = to.shutdown(Shutdown::Both);
}

fn made_quietly(command: &mut Command) -> &mut Command {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null())
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A server that takes connections and answers each with `answer`.
pub fn server(answer: &'static [u8]) -> u16 {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || {
        for mut connection in listener.incoming().flatten() {
            std::thread::spawn(move || {
                let _ = connection.write_all(answer);
                while connection.read(&mut [0; 1024]).is_ok_and(|read| read > 0) {}
            });
        }
    });
    port
}

/// Makes an authority (`ca`), a certificate of it for `localhost` (`server`) and another authority (`other`) in `folder`;
/// whether that worked is said.
pub fn certificates(folder: &Path) -> bool {
    let script = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=authority -keyout ca.key -out ca.crt \
         -addext basicConstraints=critical,CA:TRUE && \
         openssl req -newkey rsa:2048 -nodes -subj /CN=localhost -keyout server.key -out server.csr && \
         printf 'subjectAltName=DNS:localhost,IP:127.0.0.1\\nbasicConstraints=CA:FALSE\\n' > ext && \
         openssl x509 -req -in server.csr -CA ca.crt -CAkey ca.key -CAcreateserial -days 2 -extfile ext -out server.crt && \
         openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=stranger -keyout other.key -out other.crt";
    let made = Command::new("sh").arg("-c").arg(script).current_dir(folder).output();
    let has_worked = made.is_ok_and(|made| made.status.success());
    if !has_worked {
        println!("skipped: there is no openssl that makes certificates");
    }
    has_worked
}

/// A message as it was heard.
#[derive(Debug, Clone, PartialEq)]
pub struct Heard {
    /// Whether it was retained before the listener came.
    pub is_old: bool,
    pub topic: String,
    pub payload: String,
}

pub struct Listener {
    stop: Box<dyn FnMut()>,
    heard: Arc<Mutex<Vec<Heard>>>,
}

impl Listener {
    pub fn heard(&self) -> Vec<Heard> {
        self.heard.lock().unwrap().clone()
    }

    /// The payloads under a topic.
    pub fn under(&self, topic: &str) -> Vec<String> {
        self.heard().into_iter().filter(|h| h.topic == topic).map(|h| h.payload).collect()
    }

    pub fn wait_for(&self, topic: &str, payload: &str) {
        wait_until(&format!("{payload} under {topic}"), || self.under(topic).iter().any(|p| p == payload));
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        (self.stop)();
    }
}
