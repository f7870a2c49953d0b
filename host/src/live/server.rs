//! Answers to the page's requests, for this machine only.

use super::Shared;
use std::fmt::Write;
use std::io;
use std::sync::{Arc, PoisonError};
use std::time::Instant;
use tiny_http::{Header, Method, Request, Response};

const PAGE: &str = include_str!("page.html");
const STYLES: [&str; 2] =
    [include_str!("../report/html/style.css"), include_str!("../report/viewer/viewer.css")];
/// The viewer's renderer, and what is of this page.
const SCRIPT: [&str; 6] = [
    include_str!("../report/viewer/vector.js"),
    include_str!("../report/viewer/decode.js"),
    include_str!("../report/viewer/shaders.js"),
    include_str!("../report/viewer/renderer.js"),
    include_str!("../report/viewer/camera.js"),
    include_str!("page.js"),
];
/// Random bytes of the address.
const TOKEN_BYTES: usize = 16;
/// Headers of every answer. The page loads nothing from elsewhere and is shown in no other page.
const HEADERS: [(&str, &str); 4] = [
    ("Cache-Control", "no-store"),
    ("Content-Security-Policy", "default-src 'self' 'unsafe-inline' data:; frame-ancestors 'none'"),
    ("Referrer-Policy", "no-referrer"),
    ("X-Content-Type-Options", "nosniff"),
];

/// A server at a port of the loopback interface.
pub struct Server {
    http: tiny_http::Server,
    port: u16,
    token: String,
}

/// An answer: its type and its bytes.
type Content = (&'static str, Arc<[u8]>);

impl Server {
    /// Takes a free port.
    pub fn bind() -> io::Result<Self> {
        let http = tiny_http::Server::http("127.0.0.1:0").map_err(io::Error::other)?;
        let address = http.server_addr().to_ip().ok_or(io::ErrorKind::AddrNotAvailable)?;
        let mut random = [0; TOKEN_BYTES];
        getrandom::fill(&mut random).map_err(io::Error::other)?;
        let token = random.iter().fold(String::new(), |mut token, byte| {
            // Writing to a string cannot fail.
            let _ = write!(token, "{byte:02x}");
            token
        });
        Ok(Self { http, port: address.port(), token })
    }

    /// Address of the page.
    pub fn url(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// Returns true if a request names this server as its host: another page that resolves its own
    /// name to this machine does not.
    fn is_addressed(&self, request: &Request) -> bool {
        let host = request.headers().iter().find(|header| header.field.equiv("Host"));
        let host = host.map(|header| header.value.as_str());
        ["127.0.0.1", "localhost"]
            .iter()
            .any(|name| host == Some(format!("{name}:{}", self.port).as_str()))
    }
}

/// Answers requests until the process ends.
pub(super) fn serve(server: &Server, shared: &Shared) {
    while let Ok(request) = server.http.recv() {
        let (status, (kind, bytes)) = if !server.is_addressed(&request) {
            (403, text("this address is not for you"))
        } else if *request.method() != Method::Get {
            (405, text("only GET"))
        } else {
            let path =
                request.url().strip_prefix('/').and_then(|url| url.strip_prefix(&server.token));
            match path.and_then(|path| answer(path, shared)) {
                Some(content) => (200, content),
                None => (404, text("nothing here: open the address that the run printed")),
            }
        };
        let mut response = Response::from_data(bytes.to_vec())
            .with_status_code(status)
            .with_header(header("Content-Type", kind));
        for (field, value) in HEADERS {
            response.add_header(header(field, value));
        }
        // A page that is gone needs no answer.
        let _ = request.respond(response);
    }
}

fn text(words: &str) -> Content {
    ("text/plain; charset=utf-8", words.as_bytes().into())
}

fn header(field: &str, value: &str) -> Header {
    let header = Header::from_bytes(field, value);
    header.unwrap_or_else(|()| unreachable!("headers are constants of printable letters"))
}

/// Content at a path below the token's; `None` where nothing is.
fn answer(path: &str, shared: &Shared) -> Option<Content> {
    let (name, query) = path.split_once('?').unwrap_or((path, ""));
    let number = |key: &str| {
        let mut parts = query.split('&').filter_map(|part| part.split_once('='));
        parts.find(|(name, _)| *name == key).and_then(|(_, value)| value.parse::<u64>().ok())
    };
    let picture = |kind, number| Some((kind, shared.news().picture(number)?));
    match name {
        "/" => Some(("text/html; charset=utf-8", page().into_bytes().into())),
        "/news" => {
            *shared.last_request.lock().unwrap_or_else(PoisonError::into_inner) =
                Some(Instant::now());
            let (version, positions) = (number("since")?, number("path")?);
            let news = shared.news().since(version, positions as usize);
            Some(("application/json", news.into()))
        }
        "/region" => {
            let bytes = shared.news().region(u32::try_from(number("id")?).ok()?)?;
            Some(("application/octet-stream", bytes))
        }
        "/left" => picture("image/jpeg", 0),
        "/disparity" => picture("image/jpeg", 1),
        "/masks" => picture("image/png", 2),
        _ => None,
    }
}

fn page() -> String {
    let script = format!("(() => {{\n\"use strict\";\n{}}})();", SCRIPT.concat());
    PAGE.replace("/*STYLE*/", &STYLES.concat()).replace("/*SCRIPT*/", &script)
}
