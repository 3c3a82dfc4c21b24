//! Who may ask: no foreign page, nobody without the token where one is needed.

use crate::error::Refusal;
use crate::studio::Studio;
use crate::trial::read_only;
use axum::extract::{Request, State};
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, Uri, uri::Authority};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

/// Nothing but what comes from here is run, shown or asked; pictures are made of what came (`blob:`).
const CONTENT_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; \
    connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HEADERS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT_POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// The cookie that a browser is given in exchange for the token in its first address.
const COOKIE: &str = "pursuit_token";
/// Answers to wrong tokens come late, so that guessing takes for ever.
const WRONG_TOKEN_DELAY: Duration = Duration::from_millis(500);

/// What a request must bring.
#[derive(Debug)]
pub(crate) struct Guard {
    /// The name or address that the user chose to listen at.
    pub host: String,
    pub port: u16,
    pub loopback: bool,
    /// None on the loopback.
    pub token: Option<String>,
}

/// Looks at every request before anything else does.
pub(crate) async fn watch(State(studio): State<Arc<Studio>>, request: Request, next: Next) -> Response {
    let mut response = match check(&studio, request.method(), request.uri(), request.headers()).await {
        Ok(None) => next.run(request).await,
        Ok(Some(redirect)) => redirect,
        Err(refusal) => {
            studio.metrics.refused();
            // Neither the query, which may hold a token, nor any header is written down.
            tracing::info!("refused {} {}: {}", request.method(), request.uri().path(), refusal.message);
            refusal.into_response()
        }
    };
    for (name, value) in HEADERS {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn check(studio: &Studio, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<Option<Response>, Refusal> {
    let guard = &studio.guard;
    guard.check_host(headers)?;
    guard.check_origin(headers)?;
    if studio.root.is_none() && ![Method::GET, Method::HEAD].contains(method) {
        return Err(read_only());
    }
    let Some(token) = &guard.token else { return Ok(None) };
    let given = query_value(uri, "token");
    if let Some(given) = &given {
        if same(given, token) {
            // From the address into a cookie that no script reads and no other page sends.
            let page = method == Method::GET && uri.path() == "/";
            let cookie = format!("{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/");
            let found = (StatusCode::SEE_OTHER, [(header::LOCATION, "/".to_owned()), (header::SET_COOKIE, cookie)]);
            return Ok(page.then(|| found.into_response()));
        }
    } else if presented(headers).any(|p| same(&p, token)) {
        return Ok(None);
    }
    // One wrong guess after the other, whatever the number of connections.
    let _turn = studio.wrong_tokens.lock().await;
    tokio::time::sleep(WRONG_TOKEN_DELAY).await;
    let message =
        "a token is needed; open the address that `pursuit studio` printed, or send Authorization: Bearer TOKEN";
    Err(Refusal::new(StatusCode::UNAUTHORIZED, message))
}

impl Guard {
    /// A name that an attacker's server resolves to this machine is not ours: only addresses and the name chosen are.
    fn check_host(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let mut hosts = headers.get_all(header::HOST).iter();
        let host = hosts.next().and_then(|h| h.to_str().ok()).and_then(|h| h.parse::<Authority>().ok());
        let fits = host.as_ref().is_some_and(|h| self.is_ours(h)) && hosts.next().is_none();
        if fits { Ok(()) } else { Err(Refusal::new(StatusCode::FORBIDDEN, "this is not the studio's own address")) }
    }

    /// A page from elsewhere says so in its requests; programs that are no browsers say nothing.
    fn check_origin(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let refused = || Err(Refusal::new(StatusCode::FORBIDDEN, "requests of other pages are not answered"));
        if headers.get("sec-fetch-site").is_some_and(|site| site != "same-origin" && site != "none") {
            return refused();
        }
        let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
        let host = headers.get(header::HOST).and_then(|h| h.to_str().ok()).unwrap_or_default();
        let own = origin.to_str().is_ok_and(|o| o.eq_ignore_ascii_case(&format!("http://{host}")));
        if own { Ok(()) } else { refused() }
    }

    fn is_ours(&self, host: &Authority) -> bool {
        let name = host.host().trim_start_matches('[').trim_end_matches(']');
        let address = name.parse::<IpAddr>().ok();
        let known = match address {
            Some(ip) => !self.loopback || ip.is_loopback(),
            None => name.eq_ignore_ascii_case("localhost") || name.eq_ignore_ascii_case(&self.host),
        };
        known && !host.as_str().contains('@') && host.port_u16().unwrap_or(80) == self.port
    }
}

/// Tokens in the header or the cookie.
fn presented(headers: &HeaderMap) -> impl Iterator<Item = String> + '_ {
    let bearer = headers.get_all(header::AUTHORIZATION).iter().filter_map(|h| h.to_str().ok()?.strip_prefix("Bearer "));
    let cookies = headers.get_all(header::COOKIE).iter().filter_map(|h| h.to_str().ok());
    let cookies = cookies.flat_map(|h| h.split(';')).filter_map(|c| c.trim().strip_prefix(COOKIE)?.strip_prefix('='));
    bearer.chain(cookies).map(str::to_owned)
}

fn query_value(uri: &Uri, name: &str) -> Option<String> {
    let pairs = uri.query()?.split('&').filter_map(|pair| pair.split_once('='));
    pairs.into_iter().find(|(key, _)| *key == name).map(|(_, value)| value.to_owned())
}

/// Whether both are the same, in a time that does not tell where they differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |different, (x, y)| different | (x ^ y)) == 0
}

/// 128 random bits in hexadecimal digits.
pub(crate) fn new_token() -> Result<String, getrandom::Error> {
    let mut bits = [0_u8; 16];
    getrandom::fill(&mut bits)?;
    Ok(bits.iter().map(|b| format!("{b:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(loopback: bool) -> Guard {
        Guard { host: if loopback { "127.0.0.1" } else { "lab.example" }.to_owned(), port: 8000, loopback, token: None }
    }

    #[test]
    fn only_our_own_addresses_are_ours() {
        let ours = |g: &Guard, host: &str| g.is_ours(&host.parse().unwrap());
        let loopback = guard(true);
        for host in ["127.0.0.1:8000", "localhost:8000", "LOCALHOST:8000", "[::1]:8000"] {
            assert!(ours(&loopback, host), "{host}");
        }
        for host in
            ["127.0.0.1", "127.0.0.1:80", "evil.example:8000", "10.0.0.1:8000", "me@127.0.0.1:8000", "localhost.x:8000"]
        {
            assert!(!ours(&loopback, host), "{host}");
        }
        let open = guard(false);
        assert!(ours(&open, "10.0.0.1:8000") && ours(&open, "lab.example:8000") && !ours(&open, "evil.example:8000"));
    }

    #[test]
    fn tokens_are_long_and_never_the_same() {
        let (a, b) = (new_token().unwrap(), new_token().unwrap());
        assert!(a.len() == 32 && !same(&a, &b) && same(&a, &a.clone()) && !same(&a, &a[1..]));
    }
}
