//! Obstacle messages for an autopilot, sent after every frame.

use super::{Finished, FrameContext, ObserveError, ObservedRun, Observer};
use crate::request::searched_from_m;
use dynvox_core::{Config, PoseOrigin};
use dynvox_onboard::mavlink::{Sender, obstacle_distance, obstacle_distance_3d};
use dynvox_onboard::{Band, Vehicle, points, sectors};
use serde::{Deserialize, Serialize};
use std::net::{SocketAddr, UdpSocket};

/// Obstacle avoidance (`MAV_COMP_ID_OBSTACLE_AVOIDANCE`).
const COMPONENT: u8 = 196;
/// Number of the vehicle.
const SYSTEM: u8 = 1;
/// Radius of the vehicle, m.
const BODY_M: f32 = 0.3;
/// Height above and below the vehicle that must be free, m.
const HALF_HEIGHT_M: f32 = 0.5;
/// Time ahead for which moving obstacles are told as well, s: that in which an autopilot reacts.
const AHEAD_S: f32 = 0.75;
/// Time after which a look at a free cell is too old, s.
const STALE_S: f32 = 3.0;

/// Messages of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MavlinkSection {
    /// Messages sent.
    pub sent: u64,
    /// Messages that the system refused to send.
    pub failed: u64,
}

/// Sends `OBSTACLE_DISTANCE` after every frame, where a run is asked to; where it is asked for
/// points, one `OBSTACLE_DISTANCE_3D` for each direction that ends at an obstacle as well.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct MavlinkObserver {
    sent: u64,
    failed: u64,
    /// The way out; opened with the first message, again after a resume.
    #[serde(skip)]
    socket: Option<UdpSocket>,
}

/// The space that is looked at: as far as the window reaches to every side.
fn band(config: &Config, size_cells: [usize; 3], cell_m: f64) -> Band {
    let [width, length, _] = size_cells;
    // The vehicle stands in the middle, but for a cell.
    let half_m = (width.min(length) as f64 / 2.0 - 1.0) * cell_m;
    Band {
        body_m: BODY_M,
        near_m: searched_from_m(config).max(f64::from(config.planning.near_m)) as f32,
        far_m: (half_m as f32).min(config.planning.far_m),
        up_m: HALF_HEIGHT_M,
        down_m: HALF_HEIGHT_M,
        stale_frames: (STALE_S / config.tracking.frame_interval_s).ceil() as u32,
    }
}

impl MavlinkObserver {
    /// The sender of the next message.
    fn sender(&self) -> Sender {
        // Eight bits, which wrap around.
        let sequence = (self.sent + self.failed) as u8;
        Sender { system: SYSTEM, component: COMPONENT, sequence }
    }

    /// Sends bytes, and counts them.
    fn send(&mut self, bytes: &[u8], to: SocketAddr) {
        if self.socket.is_none() {
            let any: SocketAddr = if to.is_ipv4() {
                ([0, 0, 0, 0], 0).into()
            } else {
                (std::net::Ipv6Addr::UNSPECIFIED, 0).into()
            };
            self.socket = UdpSocket::bind(any).ok();
        }
        let sent = self.socket.as_ref().is_some_and(|socket| socket.send_to(bytes, to).is_ok());
        // An autopilot that is not there must not end a run.
        *(if sent { &mut self.sent } else { &mut self.failed }) += 1;
    }
}

impl Observer for MavlinkObserver {
    type Section = Option<MavlinkSection>;

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let Some(address) = run.plan.request.exports.mavlink else { return Ok(()) };
        let report = &frame.row.report;
        // A pose that is extrapolated is none to place obstacles by.
        let is_placed = report.pose != PoseOrigin::Extrapolated;
        let vehicle = Vehicle::new(&report.t_world_camera, is_placed);
        let mapper = frame.view.mapper();
        let planning = mapper.planning();
        let band = band(mapper.config(), planning.size(), planning.grid().cell_m());
        // As it will be, and as it is: an autopilot's rule takes all obstacles for standing.
        let [later, now] = [AHEAD_S, 0.0].map(|ahead_s| {
            frame.view.plan(ahead_s);
            sectors(frame.view.mapper().planning(), &vehicle, &band)
        });
        let around = now.or_nearer(&later);
        let time_ns = frame.row.time_ns();
        let message = obstacle_distance(&around, time_ns / 1_000, self.sender());
        self.send(message.bytes(), address.0);
        if run.plan.request.exports.mavlink_points {
            // All points of a frame have one time, by which readers tell frames apart.
            let time_ms = (time_ns / 1_000_000) as u32;
            for point_m in points(&around) {
                let message = obstacle_distance_3d(point_m, &around, time_ms, self.sender());
                self.send(message.bytes(), address.0);
            }
        }
        Ok(())
    }

    fn finish(
        self,
        run: &ObservedRun<'_>,
        _: &Finished,
    ) -> Result<Option<MavlinkSection>, ObserveError> {
        let asked = run.plan.request.exports.mavlink.is_some();
        Ok(asked.then_some(MavlinkSection { sent: self.sent, failed: self.failed }))
    }
}
