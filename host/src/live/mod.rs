//! A page that shows a run while it drives: map, pictures and figures.
//!
//! The run never waits for the page. It hands over figures after each frame, and blocks of the map
//! now and then; a thread of its own draws them, and what comes while that thread is busy is left
//! out. The page asks for news several times a second, at an address of this machine only.

mod map;
mod news;
mod server;

pub use map::{MapRegion, MapUpdate};
pub use news::{LiveFigures, LivePictures};

use map::draw;
use news::News;
use server::serve;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// A page without requests for so long is closed.
const WATCHED: Duration = Duration::from_secs(3);
/// Threads that answer requests.
const SERVERS: usize = 2;

/// State shared by the run, the thread that draws and those that answer.
struct Shared {
    news: Mutex<News>,
    last_request: Mutex<Option<Instant>>,
    is_drawing: AtomicBool,
}

impl Shared {
    /// The news. A thread that failed leaves them as they were.
    fn news(&self) -> MutexGuard<'_, News> {
        self.news.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The page of a run.
pub struct LiveView {
    shared: Arc<Shared>,
    updates: SyncSender<MapUpdate>,
    url: String,
}

impl LiveView {
    /// Serves the page at a free port of this machine, under a random address.
    ///
    /// # Errors
    /// The system refuses a port, a thread or random numbers.
    pub fn begin() -> io::Result<Self> {
        let shared = Arc::new(Shared {
            news: Mutex::default(),
            last_request: Mutex::default(),
            is_drawing: AtomicBool::new(false),
        });
        let server = server::Server::bind()?;
        let url = server.url();
        let server = Arc::new(server);
        for _ in 0..SERVERS {
            let (server, shared) = (Arc::clone(&server), Arc::clone(&shared));
            thread::Builder::new().spawn(move || serve(&server, &shared))?;
        }
        let (updates, received) = sync_channel::<MapUpdate>(1);
        let drawing = Arc::clone(&shared);
        thread::Builder::new().spawn(move || {
            for update in received {
                // Without memory for a region the page keeps what it has of it.
                let drawn = draw(&update).unwrap_or_default();
                drawing.news().add_regions(drawn);
                drawing.is_drawing.store(false, Ordering::Release);
            }
        })?;
        Ok(Self { shared, updates, url })
    }

    /// Address of the page.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Returns true if a page asked for news of late.
    pub fn is_watched(&self) -> bool {
        let last = self.shared.last_request.lock().unwrap_or_else(PoisonError::into_inner);
        last.is_some_and(|at| at.elapsed() < WATCHED)
    }

    /// Adds the figures of a frame.
    pub fn add_frame(&self, figures: LiveFigures) {
        self.shared.news().add_frame(figures);
    }

    /// Shows other pictures.
    pub fn show(&self, pictures: LivePictures) {
        self.shared.news().set_pictures(pictures);
    }

    /// Returns true if blocks offered now are drawn.
    pub fn can_draw(&self) -> bool {
        !self.shared.is_drawing.load(Ordering::Acquire)
    }

    /// Draws regions of the map, unless others are being drawn. Returns true if they will be.
    pub fn draw(&self, update: MapUpdate) -> bool {
        if !self.can_draw() {
            return false;
        }
        self.shared.is_drawing.store(true, Ordering::Release);
        self.updates.try_send(update).is_ok()
    }
}

impl std::fmt::Debug for LiveView {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LiveView").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
