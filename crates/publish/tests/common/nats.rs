//! A real NATS server, and an independent listener: the few words of its protocol, written and read here.

use super::{Heard, Listener, free_port, made_quietly, program, wait_until};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpStream};
use std::path::Path;
use std::process::{Child, Command};
use std::sync::{Arc, Mutex};

/// A server on a port of its own.
pub struct NatsServer {
    folder: tempfile::TempDir,
    pub port: u16,
    child: Option<Child>,
}

impl NatsServer {
    /// None where it is not installed, which is said. `settings` are lines of its configuration, made with the folder that it
    /// lies in.
    pub fn start(settings: impl FnOnce(&Path) -> String) -> Option<Self> {
        if program("nats-server").is_none() {
            println!("skipped: there is no NATS server; install `nats-server`");
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let port = free_port();
        let text = format!("listen: \"127.0.0.1:{port}\"\n{}\n", settings(folder.path()));
        std::fs::write(folder.path().join("server.conf"), text).unwrap();
        let mut server = Self { folder, port, child: None };
        server.again();
        Some(server)
    }

    pub fn open() -> Option<Self> {
        Self::start(|_| String::new())
    }

    pub fn again(&mut self) {
        let mut command = Command::new(program("nats-server").unwrap());
        command.arg("-c").arg(self.folder.path().join("server.conf"));
        self.child = Some(made_quietly(&mut command).spawn().unwrap());
        let port = self.port;
        wait_until("the server", || TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_ok());
    }

    pub fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    /// Stops it where it is, or lets it go on.
    #[cfg(unix)]
    pub fn hang(&self, is_hung: bool) {
        self.child.iter().for_each(|child| super::hang(child, is_hung));
    }

    /// A listener to every subject but those of inboxes. It listens when this returns, until the server goes.
    pub fn listen(&self) -> Listener {
        self.listen_as("")
    }

    /// The same as a user: `"user":"me","pass":"sesame",`.
    pub fn listen_as(&self, login: &str) -> Listener {
        let mut client = Client::connect(self.port, login);
        client.say("SUB > 1\r\nPING\r\n");
        while client.line().is_some_and(|line| line != "PONG") {}
        let heard: Arc<Mutex<Vec<Heard>>> = Arc::default();
        let (all, stream) = (heard.clone(), client.stream.try_clone().unwrap());
        std::thread::spawn(move || {
            while let Some((subject, payload)) = client.message() {
                if !subject.starts_with("_INBOX.") {
                    let payload = String::from_utf8(payload).unwrap();
                    all.lock().unwrap().push(Heard { is_old: false, topic: subject, payload });
                }
            }
        });
        let stop = move || {
            let _ = stream.shutdown(Shutdown::Both);
        };
        Listener { stop: Box::new(stop), heard }
    }

    /// What the server answers to a request.
    pub fn ask(&self, subject: &str, payload: &str) -> String {
        let mut client = Client::connect(self.port, "");
        client.say(&format!("SUB answers 1\r\nPUB {subject} answers {}\r\n{payload}\r\n", payload.len()));
        String::from_utf8(client.message().unwrap().1).unwrap()
    }
}

impl Drop for NatsServer {
    fn drop(&mut self) {
        self.kill();
    }
}

struct Client {
    stream: TcpStream,
    lines: BufReader<TcpStream>,
}

impl Client {
    fn connect(port: u16, login: &str) -> Self {
        let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
        let lines = BufReader::new(stream.try_clone().unwrap());
        let mut client = Self { stream, lines };
        assert!(client.line().is_some_and(|line| line.starts_with("INFO ")));
        client.say(&format!("CONNECT {{{login}\"verbose\":false,\"pedantic\":false}}\r\n"));
        client
    }

    fn say(&mut self, text: &str) {
        self.stream.write_all(text.as_bytes()).unwrap();
    }

    fn line(&mut self) -> Option<String> {
        let mut line = String::new();
        let read = self.lines.read_line(&mut line).unwrap_or(0);
        (read > 0).then(|| line.trim_end().to_owned())
    }

    /// The next message, subject and payload.
    fn message(&mut self) -> Option<(String, Vec<u8>)> {
        loop {
            let line = self.line()?;
            let words: Vec<&str> = line.split(' ').collect();
            match words.first() {
                Some(&"PING") => self.say("PONG\r\n"),
                Some(&"MSG") => {
                    let mut payload = vec![0; words.last()?.parse::<usize>().unwrap() + 2];
                    self.lines.read_exact(&mut payload).ok()?;
                    payload.truncate(payload.len() - 2);
                    return Some((words[1].to_owned(), payload));
                }
                _ => {}
            }
        }
    }
}
