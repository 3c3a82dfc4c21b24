//! Listens, and gives every connection a bounded time and place.

use crate::error::StudioError;
use crate::guard::{Guard, new_token};
use crate::metrics::Metrics;
use crate::root::Root;
use crate::studio::{Studio, Trials};
use crate::trial::Job;
use crate::uploads::Uploads;
use crate::{Options, Picked, api};
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::io::Write;
use std::net::{SocketAddr, TcpListener, ToSocketAddrs};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::sync::Semaphore;

/// Connections that are served at once.
const MOST_CONNECTIONS: usize = 256;
/// Further ones that wait until one is closed; those beyond are refused.
const MOST_WAITING: usize = 64;
/// The answer to a connection beyond the limit.
const FULL: &[u8] =
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nConnection: close\r\nRetry-After: 5\r\n\r\n";
/// A connection on which no request comes for this long is closed.
const PATIENCE: Duration = Duration::from_secs(15);
/// The longest head of a request, bytes.
const LONGEST_HEAD: usize = 32 << 10;
/// From a box that was drawn to the end of a studio that was opened for it.
const FAREWELL: Duration = Duration::from_millis(400);
/// How long trials may take to write down what they know when the studio ends.
const LAST_WORDS: Duration = Duration::from_secs(10);
/// Threads that answer requests; trials have their own.
const THREADS: usize = 2;

/// A studio that listens and waits to be [`run`](Self::run).
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    studio: Arc<Studio>,
}

impl Server {
    /// Checks the options and listens.
    ///
    /// # Errors
    /// A root that is no folder, an address that cannot be listened at.
    pub fn open(options: Options) -> Result<Self, StudioError> {
        let root = Root::new(&options.root)?;
        Self::listen(options, Some(root), Trials::new)
    }

    /// The same for a job that is only watched.
    pub(crate) fn watching(options: Options, job: Arc<Job>) -> Result<Self, StudioError> {
        Self::listen(options, None, |chance| Trials::new(chance).watching(job))
    }

    fn listen(options: Options, root: Option<Root>, trials: impl FnOnce(u32) -> Trials) -> Result<Self, StudioError> {
        let Options { input, host, port, pick, patience, open, .. } = options;
        let at = || format!("{host}:{port}");
        let listen = |source| StudioError::Listen { address: at(), source };
        let name = host.trim_start_matches('[').trim_end_matches(']');
        let addresses: Vec<SocketAddr> = (name, port).to_socket_addrs().map_err(listen)?.collect();
        let listener = TcpListener::bind(&*addresses).map_err(listen)?;
        let address = listener.local_addr().map_err(listen)?;
        listener.set_nonblocking(true).map_err(listen)?;
        let loopback = address.ip().is_loopback();
        let system = |e: &dyn std::fmt::Display| StudioError::System(e.to_string());
        let token = if loopback { None } else { Some(new_token().map_err(|e| system(&e))?) };
        let chance = getrandom::u32().map_err(|e| system(&e))?;
        let uploads = Uploads::new().map_err(|e| system(&e))?;
        let guard = Guard { host: name.to_owned(), port: address.port(), loopback, token };
        let studio = Studio {
            guard,
            root,
            uploads,
            metrics: Metrics::default(),
            given: input,
            options: open,
            picking: pick,
            picked: OnceLock::new(),
            wrong_tokens: tokio::sync::Mutex::new(()),
            filming: tokio::sync::Mutex::new(()),
            patience,
            trials: Mutex::new(trials(chance)),
        };
        Ok(Self { listener, address, studio: Arc::new(studio) })
    }

    /// Where it listens.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// What to open in a browser; holds the token where one is needed.
    pub fn url(&self) -> String {
        let guard = &self.studio.guard;
        let host = match self.address.ip() {
            ip if ip.is_unspecified() => "localhost".to_owned(),
            _ if guard.host.parse::<std::net::Ipv6Addr>().is_ok() => format!("[{}]", guard.host),
            _ => guard.host.clone(),
        };
        let token = guard.token.as_ref().map(|t| format!("?token={t}")).unwrap_or_default();
        format!("http://{host}:{}/{token}", self.address.port())
    }

    /// Answers requests until a box has been drawn, or `stopped` says so: then there is none.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn pick(self, stopped: impl Fn() -> bool) -> Result<Option<Picked>, StudioError> {
        let studio = self.studio.clone();
        let drawn_at = OnceLock::new();
        // The page is to hear that its box was taken.
        let told = || studio.picked.get().is_some() && drawn_at.get_or_init(Instant::now).elapsed() >= FAREWELL;
        self.run(|| stopped() || told())?;
        Ok(studio.picked.get().copied())
    }

    /// Answers requests until `stopped` says so, asked a few times a second.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub fn run(self, stopped: impl Fn() -> bool) -> Result<(), StudioError> {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(THREADS).enable_all().build();
        let runtime = runtime.map_err(|e| StudioError::System(e.to_string()))?;
        runtime.block_on(async move {
            let listener = tokio::net::TcpListener::from_std(self.listener);
            let listener = listener.map_err(|e| StudioError::System(e.to_string()))?;
            let studio = self.studio.clone();
            let router = api::router(self.studio);
            let known = Arc::new(Semaphore::new(MOST_CONNECTIONS + MOST_WAITING));
            let places = Arc::new(Semaphore::new(MOST_CONNECTIONS));
            let accept = async {
                loop {
                    match listener.accept().await {
                        Ok((stream, _)) => {
                            let Ok(one) = known.clone().try_acquire_owned() else {
                                studio.metrics.turned_away();
                                // As much as goes at once; nobody is waited for.
                                let _ = stream.into_std().and_then(|mut stream| stream.write(FULL));
                                continue;
                            };
                            let (router, places) = (router.clone(), places.clone());
                            tokio::spawn(async move {
                                if let Ok(_place) = places.acquire().await {
                                    serve(stream, router).await;
                                }
                                drop(one);
                            });
                        }
                        // Out of files, say: those that are open will be closed.
                        Err(_) => tokio::time::sleep(Duration::from_millis(50)).await,
                    }
                }
            };
            let watch = async {
                while !stopped() {
                    tokio::time::sleep(Duration::from_millis(100)).await;
                    studio.close_forgotten().await;
                }
            };
            tokio::select! {
                () = accept => {}
                () = watch => {}
            }
            // What they know is kept before the program ends.
            let _ = tokio::time::timeout(LAST_WORDS, studio.close_all()).await;
            Ok::<_, StudioError>(())
        })?;
        runtime.shutdown_timeout(Duration::from_secs(1));
        Ok(())
    }
}

async fn serve(stream: TcpStream, router: Router) {
    // Small messages are not to wait for larger ones.
    let _ = stream.set_nodelay(true);
    let service = TowerToHyperService::new(router);
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(LONGEST_HEAD);
    let connection = http.serve_connection(TokioIo::new(stream), service).with_upgrades();
    if let Err(error) = connection.await {
        tracing::debug!("a connection broke off: {error}");
    }
}
