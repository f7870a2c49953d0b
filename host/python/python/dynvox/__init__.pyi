"""Stereo dense mapping of streets with moving cars, for numpy.

Axes are KITTI's: x right, y down, z forward; the first left camera is the world. Poses map camera to world. Lengths are metres, disparities
1/256 px. Every error is an `Error` with the sentence that the command line prints. Pose, Track, Region, Raycast, Plan, Finding and Frame are dictionaries: import their
names under `typing.TYPE_CHECKING` alone.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, TypedDict, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self

__version__: str

class Error(Exception):
    """What is wrong, and what to do about it."""

class Pose(TypedDict):
    """A rigid motion. `matrix` makes a matrix of it."""

    rotation: tuple[float, float, float, float]
    """Quaternion: x, y, z, w."""
    translation_m: tuple[float, float, float]

class Track(TypedDict):
    """An object as it stands after a step."""

    id: int
    """Its number, from 1, never used again."""
    class_name: str
    state: Literal["uncertain", "static", "dynamic"]
    score: float
    """Score of its last detection."""
    detected: bool
    """Whether it was detected in this frame."""
    first_frame: int
    last_frame: int
    sightings: int
    """Frames it was detected in."""
    box_px: list[int]
    """Left, top, width, height in the left image, where it was last detected."""
    speed_m_s: float | None
    speed_sigma_m_s: float | None
    measured: bool
    """Whether the motion was measured in this frame; if not it is extrapolated."""
    center_world_m: list[float]
    """Centre of its matches before this frame's motion."""
    motion_world: Pose
    """Motion over ground within this frame."""
    t_world_object: Pose | None
    matches: int
    inliers: int
    blocks: int
    """Blocks of its volume; 0 where it is not reconstructed."""

class Region(TypedDict):
    """A region of the slab, in bytes."""

    name: str
    bytes: int
    used: int
    peak: int
    placement: str
    """`hot` or `cold`: the kind of memory it belongs in, where a machine has a fast and a large one."""

class Raycast(TypedDict):
    """The map as a camera sees it, height x width each."""

    depth_m: NDArray[np.float32]
    """Depth along z; 0 where there is no surface."""
    normal: NDArray[np.int8]
    """Normal in camera axes, towards the camera, times 127."""
    colour: NDArray[np.uint8]
    weight: NDArray[np.uint8]
    """Observations at the nearest point of the lattice."""
    object: NDArray[np.uint32]
    """Number of the track a pixel shows; 0 for the static map."""

class Frame(TypedDict, total=False):
    """The keywords of `Mapper.step`. `left` and `right` are always there."""

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    colour: NDArray[np.uint8]
    disparity_q8: NDArray[np.uint16]
    t_world_camera: Pose
    time_ns: int
    detections: list[Detection]
    inertial: tuple[NDArray[np.uint64], NDArray[np.float64]]

class Finding(TypedDict):
    """A fault of pictures, as `diagnose` finds it."""

    fault: Literal["not_rectified", "exchanged", "same_image", "baseline", "exposure", "black", "saturated", "focus", "unknown"]
    message: str
    """What is wrong, and what to do about it."""
    refused: bool
    """Whether a map would be meaningless."""

@final
class Rig:
    """Two identical pinhole cameras, rectified. That of a data set or of `read_calibration` can also be of raw cameras: the mapper rectifies then.

    Rigs of equal numbers are equal, and can be pickled.
    """

    def __new__(cls, focal_px: float, center_u_px: float, center_v_px: float, baseline_m: float) -> Self: ...
    @property
    def focal_px(self) -> float:
        """Focal length, px."""

    @property
    def center_u_px(self) -> float:
        """Column of the principal point, px from the centre of the upper left pixel."""

    @property
    def center_v_px(self) -> float:
        """Row of the principal point, px from the centre of the upper left pixel."""

    @property
    def baseline_m(self) -> float:
        """Distance between the cameras, m."""

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of rectified pictures, where known."""

    @property
    def raw_size(self) -> tuple[int, int] | None:
        """Width and height of raw pictures; None where pairs come rectified."""

def read_calibration(
    *files: str | PathLike[str],
    image: tuple[int, int] | None = None,
    rectified: tuple[int, int] | None = None,
    rectified_focal_px: float | None = None,
) -> Rig:
    """Reads a calibration in any format that `dynvox calibration` reads: one file with both cameras, or one for each.

    `image` is the raw pictures' size, where the files do not say it; `rectified` and `rectified_focal_px` are as the options of that name.
    """

@final
class InertialUnit:
    """Inertial unit that is fixed to the left camera: `t_camera_unit` maps its axes to those of the rectified left camera. `Mapper(rig, inertial_unit=...)` then
    takes its samples with every frame.

    `clock_offset_s` is added to the samples' times; what remains is found from the turns. `turn_density` is the noise of turn rates, rad/s/sqrt(Hz), `turn_bias_sigma`
    the bias that they may begin with, rad/s, `turn_walk` its random walk, rad/s2/sqrt(Hz), and `force_bias_sigma` the error of forces, m/s2. A sample at
    `turn_range`, rad/s, or `force_range`, m/s2, is saturated.
    """

    def __new__(
        cls,
        t_camera_unit: ArrayLike | Pose,
        *,
        clock_offset_s: float = 0.0,
        turn_density: float = 0.001,
        turn_bias_sigma: float = 0.1,
        turn_walk: float = 0.0001,
        force_bias_sigma: float = 0.03,
        turn_range: float = 34.0,
        force_range: float = 150.0,
    ) -> Self: ...

@final
class Detection:
    """An instance in the left image: a mask in a box whose first column and row are `left` and `top`."""

    def __new__(
        cls, mask: NDArray[np.uint8] | NDArray[np.bool_], left: int, top: int, class_name: str = "car", score: float = 1.0
    ) -> Self: ...
    @property
    def mask(self) -> NDArray[np.uint8]:
        """Pixels of the box: not 0 where they belong to the instance."""

    @property
    def left(self) -> int:
        """First column of the box, px."""

    @property
    def top(self) -> int:
        """First row of the box, px."""

    @property
    def class_name(self) -> str:
        """Name of its class."""

    @property
    def score(self) -> float:
        """Confidence of the detector, 0 to 1."""


def diagnose(rig: Rig, pairs: Iterable[tuple[NDArray[np.uint8], NDArray[np.uint8]] | Frame]) -> list[Finding]:
    """Examines up to ten pairs without mapping them, as the command line does before a run: (left, right), or dictionaries with left and right.

    Returns what is wrong with them, an empty list when all is well.
    """

def detections_of(instances: ArrayLike, class_names: Sequence[str], scores: Sequence[float] | None = None) -> list[Detection]:
    """Detections of an image of instances: pixel k shows instance k, of class `class_names[k - 1]`; 0 shows none."""

def matrix(pose: Pose) -> NDArray[np.float64]:
    """A pose of a report as a matrix of 4 x 4."""

class Plan(TypedDict):
    """The planner's window from above: rows from the nearest to the farthest ahead, columns from left to right."""

    occupancy: NDArray[np.int8]
    """0 free, 100 occupied, -1 never seen, as in `nav_msgs/OccupancyGrid`."""
    distance_m: NDArray[np.float32]
    """To the nearest obstacle, negative within one, NaN without any."""
    height_m: NDArray[np.float32]
    """Of the ground above the corner, NaN without ground."""
    cell_m: float
    t_world_corner: NDArray[np.float64]
    """The corner of the first cell at the height of the lowest ground, 4 x 4; its axes are right, ahead and up."""
    boxes: list[dict[str, Any]]
    """Moving objects, along the window's axes."""
    report: dict[str, Any]

@final
class Mapper:
    """A stereo mapper in one slab of memory, which is taken when the pictures' size is known: with `image`, else at the first pair.

    Other threads of Python run while it is made and while it works. One mapper serves one thread at a time; others wait. It belongs to the process that made
    it: in a forked child every call is an `Error`, and the parent's mapper and files stay as they are.
    """

    def __new__(
        cls,
        rig: Rig,
        *,
        image: tuple[int, int] | None = None,
        frame_interval_s: float | None = None,
        stream: bool | str | PathLike[str] | None = None,
        memory: str | None = "256MiB",
        profile: Literal["tiny", "small", "onboard", "desktop"] | None = None,
        capacity: str | PathLike[str] | None = None,
        keyframes: int | None = None,
        planning: str | None = None,
        planning_3d: bool = False,
        threads: int | None = None,
        config: str | PathLike[str] | None = None,
        set: Mapping[str, Any] | None = None,
        dynamic: bool | None = None,
        fuse_every: int | None = None,
        instances: Literal["auto", "motion", "none"] = "auto",
        egomotion: Literal["stereo", "icp"] = "stereo",
        force: bool = False,
        channels: Literal["rgb", "bgr"] = "rgb",
        inertial_unit: InertialUnit | None = None,
    ) -> Self:
        """`image` is (width, height). `frame_interval_s` is the time between two frames without `time_ns`.

        `stream`: evicted blocks go to a temporary file (None, True), to a new file at a path, or nowhere (False): then they are lost, and counted. A file that this
        mapper did not make is never overwritten.

        The first ten pairs are examined as the command line examines a recording: exchanged, equal or unrectified pictures are an `Error` and are not mapped,
        unless `force` is given; what is doubtful is in `warnings`. `channels="bgr"` takes colour pictures as OpenCV has them, at the cost of a copy. All others are the
        options of `dynvox run`: `set={"volume.voxel_size_m": 0.1}` is `--set volume.voxel_size_m=0.1`.
        """

    def step(
        self,
        left: NDArray[np.uint8],
        right: NDArray[np.uint8],
        *,
        colour: NDArray[np.uint8] | None = None,
        classes: NDArray[np.uint8] | None = None,
        disparity_q8: NDArray[np.uint16] | None = None,
        ignored: NDArray[np.uint8] | None = None,
        t_world_camera: ArrayLike | Pose | None = None,
        time_ns: int | None = None,
        detections: Iterable[Detection] | None = None,
        inertial: tuple[ArrayLike, ArrayLike] | None = None,
    ) -> dict[str, Any]:
        """Maps one pair and returns the report, with the fields of `dynvox_core::Report` and `severity`. `segment` numbers the segment of the map
        that the pose lies in, from 0: another one begins, with that camera as its world, where the camera was lost and is not found again.

        Pictures are height x width, or height x width x 3 (red, green, blue): the left one is then fused in colour, and grey is computed.
        Nothing is copied whose pixels lie side by side in their rows; rows may lie apart, as in a part of a larger array. Other views, as `[..., ::-1]`, are
        copied. `t_world_camera` replaces the egomotion and `disparity_q8` the stereo matching: give them with every frame. No stage uses the pixels of
        `ignored`, height x width of the rectified left picture, that are not 0. A pose must be a rigid motion within the map's bounds. `fused` in the report is true only if something was fused.

        `inertial` has the samples of the mapper's inertial unit since the frame before: N times, ns on the clock of `time_ns`, and N x 6 values, turn rates in rad/s
        and accelerations in m/s2 with gravity. The report says under `inertial` what they told.
        """

    @property
    def warnings(self) -> list[str]:
        """Doubts about the first pairs, in sentences."""

    def close(self) -> None:
        """Frees the memory; every later call is an `Error`. A `with` block calls it at its end."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *error: object) -> None: ...

    def finish(self) -> dict[str, Any]:
        """Ends a sequence: prunes what is still in the window."""

    @property
    def tracks(self) -> list[Track]:
        """Tracks after the last step, oldest first."""

    def raycast(self, t_world_camera: ArrayLike | Pose | None = None, *, objects: bool = True, every: int = 1) -> Raycast:
        """The map's current segment seen from a pose in it, the last one of the camera without one; with the objects where they are now. Of the image's columns and rows every so many
        are looked at."""

    def plan(self, ahead_s: float = 0.0) -> Plan:
        """The window around the camera for planners, with moving objects where they will be `ahead_s` seconds after the last frame; an error of a mapper
        made without `planning`."""

    def triangles(self, object: int | None = None) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Triangles of the static map in the camera's segment, evicted blocks included, or of one track's object, in the world: positions in metres and colours, both
        triangles x corners x 3. Corners run counter-clockwise seen from free space."""

    @property
    def t_world_camera(self) -> NDArray[np.float64]:
        """Pose of the left camera in the last frame, 4 x 4."""

    @property
    def t_closed_driven(self) -> NDArray[np.float64]:
        """Change from the world as it is driven to the one after all loops and fixes, at the camera, 4 x 4: ROS's transform from `map` to `odom`. Reports, plans
        and objects are in the world as driven, which never jumps."""

    def add_fix(self, t_world_camera: ArrayLike | Pose, covariance: Sequence[Sequence[float]] | NDArray[np.float64]) -> None:
        """Takes a pose of the camera in the last frame that something else measured, in the world of the first camera, with its covariance, 6 x 6: rotation
        (rad), then translation (m), in the camera's axes. Like a loop it moves the keyframes, ten frames later; one that all else contradicts is taken out. The
        camera goes on in the world as driven. An error of a mapper made without `keyframes`."""

    def add_position(self, position_m: Sequence[float] | NDArray[np.float64], sigma_m: Sequence[float] | NDArray[np.float64]) -> None:
        """Takes a position of the camera in the last frame, m, with its standard deviations along the axes of the world, m, as `add_fix` takes a pose."""

    def add_vertical(self, up_camera: Sequence[float] | NDArray[np.float64], up_world: Sequence[float] | NDArray[np.float64], sigma_rad: float) -> None:
        """Takes the direction that is up in the last frame, in the camera's axes and in those of the first camera, with the standard deviation of its angle,
        rad, as `add_fix` takes a pose. It holds roll and pitch, and with them the height of a long way."""

    @property
    def disparity_q8(self) -> NDArray[np.uint16]:
        """Disparity of the last frame in 1/256 px, 0 where it is unknown: divide by 256 for pixels. Odd values of a pair that the mapper matched itself were
        filled in between measured ones, which are even. It has size 1 x 1 before the first frame."""

    @property
    def confidence(self) -> NDArray[np.uint8] | None:
        """Confidence of each disparity of the last frame, 0 without one, else 1 to 255: one more than the number of measured pixels in the 16 x 16 about it.
        None unless the setting `stereo.min_confidence` is above 0 and the mapper matched the pair itself."""

    @property
    def digest(self) -> int | None:
        """Digest of the last step; None before the first, and after `restore`."""

    @property
    def step_seconds(self) -> float | None:
        """Wall time of the last step within the core; None before the first."""

    @property
    def slab_bytes(self) -> int:
        """Bytes of the slab."""

    @property
    def config_toml(self) -> str:
        """All settings, as the config.toml of a run has them."""

    def footprint(self) -> list[Region]:
        """Every region of the slab."""

    def snapshot(self) -> bytes:
        """Everything that later steps depend on, evicted blocks included."""

    def restore(self, snapshot: bytes) -> None:
        """Continues after the step at which the snapshot was taken, bit for bit. The mapper must have been made with the same rig, bounds and
        settings. After an error it is as it was made. A file of `stream` that this mapper did not make is never touched."""

class Dataset:
    """The frames that `dynvox run PATH` would map; the synthetic street without a path.

    Options are those of `dynvox run`, with underscores. A sequence of frames: `dataset[3]`, `len(dataset)`, `for frame in dataset` (decoded ahead).
    """

    def __new__(
        cls,
        path: str | PathLike[str] | None = None,
        *,
        stream: bool | str | PathLike[str] | None = None,
        world: str | None = None,
        sequence: str | None = None,
        dataset: str | None = None,
        images: str | None = None,
        bits: int | None = None,
        bayer: str | None = None,
        topics: str | None = None,
        side_by_side: bool = False,
        top_bottom: bool = False,
        calibration: str | PathLike[str] | Sequence[str | PathLike[str]] | None = None,
        calibration_unit: str | None = None,
        lens_model: str | None = None,
        swap: str | None = None,
        vertical: bool = False,
        rectified: str | None = None,
        rectified_focal: float | None = None,
        ignore_mask: str | PathLike[str] | None = None,
        inertial: str | PathLike[str] | None = None,
        inertial_calibration: str | PathLike[str] | Sequence[str | PathLike[str]] | None = None,
        start: int | None = None,
        frames: int | None = None,
        stride: int | None = None,
        scale: float | None = None,
        depth: str | None = None,
        instances: str | None = None,
        instances_every: int | None = None,
        egomotion: str | None = None,
        faults: str | None = None,
        force: bool = False,
        memory: str | None = "256MiB",
        profile: str | None = None,
        capacity: str | PathLike[str] | None = None,
        keyframes: int | None = None,
        planning: str | None = None,
        planning_3d: bool = False,
        threads: int | None = None,
        config: str | PathLike[str] | None = None,
        set: Mapping[str, Any] | None = None,
        dynamic: bool | None = None,
        fuse_every: int | None = None,
    ) -> Self: ...
    @property
    def name(self) -> str:
        """Name of the data set."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures that are mapped."""

    @property
    def rig(self) -> Rig:
        """The cameras."""

    @property
    def notes(self) -> list[str]:
        """Assumptions, and what was left aside."""

    @property
    def warnings(self) -> list[str]:
        """Doubts about the images, in sentences."""

    @property
    def frame_interval_s(self) -> float:
        """Time between two frames, s."""

    @property
    def numbers(self) -> list[int]:
        """Numbers of the frames in the data set."""

    @property
    def times_s(self) -> list[float]:
        """Times of the frames, s."""

    @property
    def truth(self) -> NDArray[np.float64] | None:
        """True poses, frames x 4 x 4, the first at the origin."""

    def lidar(self, position: int) -> NDArray[np.float32] | None:
        """Points of a frame's LiDAR scan in the axes of the rectified left camera; None where the frame has no scan."""

    def mapper(self) -> Mapper:
        """A mapper with the bounds, settings and threads of this run."""

    def __len__(self) -> int: ...
    def __getitem__(self, position: int, /) -> Frame: ...
    def __iter__(self) -> Iterator[Frame]: ...
