// dynvox for C: stereo dense mapping in one buffer of the caller's.
//
//   static _Alignas(64) uint8_t buffer[48u << 20];
//   DynvoxCapacity capacity;                                        // what the buffer holds for images of a size
//   DynvoxBudget budget = {.bytes = sizeof buffer, .width = 752, .height = 480};
//   dynvox_capacity_for_budget(&budget, &capacity, NULL);
//   DynvoxConfig config;
//   dynvox_config_default(&rig, &config);
//   dynvox_config_set(&config, "volume.voxel_size_m", "0.05");
//   DynvoxMapper *mapper;
//   if (dynvox_create(&capacity, &config, buffer, sizeof buffer, &mapper) != DYNVOX_STATUS_OK) { ... }
//   while (next(&frame)) dynvox_step(mapper, &frame, NULL, &report);
//   dynvox_triangles(mapper, print, NULL, NULL);
//   dynvox_destroy(mapper);
//
// Ownership: the buffer is the mapper's from dynvox_create to dynvox_destroy; nothing else may touch, move or free it meanwhile. A mapper made
// or restored at its first byte replaces it; from the first byte of a snapshot on the old one is gone, even if the snapshot is damaged. All other
// arguments are read, or written, during the call only. Nothing is ever allocated, and nothing of a mapper lies elsewhere.
// Alignment: the buffer begins at a multiple of dynvox_alignment(); everything else at its type's.
// Threads: a mapper may move between threads, but one at a time may use it; mappers are independent. There are no globals.
// Callbacks run on the calling thread and must not call their own mapper.
// Errors: every function returns DYNVOX_STATUS_OK or the reason; dynvox_status_text turns it into a sentence. Null pointers, misalignment, wrong
// sizes, numbers that are not finite, and calls of its own mapper from a callback are statuses. Undefined, as everywhere in C: pointers to less
// memory than they say, handles whose buffer is gone, two threads in one mapper, a mapper made in a part of another's buffer or in that of one
// whose callback runs.
//
// Written by cbindgen from core/capi/src; DYNVOX_BLESS=1 cargo test -p dynvox-capi --test header writes it anew.


#ifndef DYNVOX_H
#define DYNVOX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Bytes of settings that a configuration holds.
#define DYNVOX_SETTINGS_BYTES 2048

// The result of a call. A call that does not return DYNVOX_STATUS_OK has changed nothing, but for
// dynvox_restore with DYNVOX_STATUS_SNAPSHOT or DYNVOX_STATUS_CALLBACK, which leaves no mapper in
// the buffer, and dynvox_save with DYNVOX_STATUS_CALLBACK, which has written a part.
typedef enum {
  // Done.
  DYNVOX_STATUS_OK = 0,
  // A pointer that must not be null is.
  DYNVOX_STATUS_NULL,
  // The buffer does not begin at a multiple of dynvox_alignment(), or another pointer not at one
  // of its type's.
  DYNVOX_STATUS_MISALIGNED,
  // The buffer or an output is too small.
  DYNVOX_STATUS_TOO_SMALL,
  // The handle is not that of a mapper: never created, destroyed, replaced without success, or a
  // copy of a buffer elsewhere.
  DYNVOX_STATUS_NO_MAPPER,
  // The call came from within a callback of the same mapper.
  DYNVOX_STATUS_BUSY,
  // A frame's memory lies within the mapper's buffer.
  DYNVOX_STATUS_OVERLAP,
  // An unknown profile, class, track or setting.
  DYNVOX_STATUS_UNKNOWN,
  // The configuration cannot be used: dynvox_config_problem says why. A calibration that is not
  // finite is one reason.
  DYNVOX_STATUS_CONFIG,
  // A pose is not finite, its rotation is not of length 1, or it lies beyond the map, whose
  // blocks have 16-bit coordinates: 13 km from the origin at 5 cm.
  DYNVOX_STATUS_POSE,
  // An image is larger than the profile allows, too small to match, or its stride is below its
  // width.
  DYNVOX_STATUS_SIZE,
  // A frame's size differs from that of the frames before.
  DYNVOX_STATUS_SIZE_CHANGED,
  // More detections than a frame can have (64).
  DYNVOX_STATUS_TOO_MANY,
  // No frame yet.
  DYNVOX_STATUS_NO_FRAME,
  // A text is not a value of its setting.
  DYNVOX_STATUS_VALUE,
  // A bound is not one a mapper can work with.
  DYNVOX_STATUS_CAPACITY,
  // A snapshot is damaged, or of another version, capacity or configuration.
  DYNVOX_STATUS_SNAPSHOT,
  // A callback refused.
  DYNVOX_STATUS_CALLBACK,
  // A frame's time is not after that of the frame before.
  DYNVOX_STATUS_TIME,
  // A fix leaves a direction without an error, or no keyframe without a fix leads from the map's
  // beginning to the camera.
  DYNVOX_STATUS_FIX,
} DynvoxStatus;

// Severity of a step's events.
typedef enum {
  // Nothing to say.
  DYNVOX_SEVERITY_INFO = 0,
  // Something went wrong and was made good within the frame.
  DYNVOX_SEVERITY_RECOVERED,
  // The map lacks what it should hold, or the pose is a guess.
  DYNVOX_SEVERITY_MAP_AFFECTED,
} DynvoxSeverity;

// Origin of a frame's pose.
typedef enum {
  // The first frame: the camera is the world, or where it is said to be.
  DYNVOX_POSE_ORIGIN_FIRST = 0,
  // Estimated from this frame.
  DYNVOX_POSE_ORIGIN_ESTIMATED,
  // A guess: the estimate failed, and the motion before was continued.
  DYNVOX_POSE_ORIGIN_EXTRAPOLATED,
  // Given with the frame.
  DYNVOX_POSE_ORIGIN_GIVEN,
  // Found in the map after the camera was lost.
  DYNVOX_POSE_ORIGIN_RELOCALIZED,
} DynvoxPoseOrigin;

// Reason why the inertial unit is not used.
typedef enum {
  // No reason is known.
  DYNVOX_INERTIAL_DOUBT_NONE = 0,
  // Turns contradict those of the images, for no reason that was found.
  DYNVOX_INERTIAL_DOUBT_CONTRADICTS,
  // Turns are as large as those of the images, about other axes.
  DYNVOX_INERTIAL_DOUBT_WRONG_AXES,
  // Turn rates seem to be in degrees per second.
  DYNVOX_INERTIAL_DOUBT_DEGREES,
  // Samples repeat.
  DYNVOX_INERTIAL_DOUBT_STUCK,
  // Samples lie at the end of the sensor's range.
  DYNVOX_INERTIAL_DOUBT_SATURATED,
  // Samples lie more than a second from the frames, or the clocks differ by more than can be
  // corrected.
  DYNVOX_INERTIAL_DOUBT_CLOCKS_APART,
} DynvoxInertialDoubt;

// Motion state of a track.
typedef enum {
  // Not known yet.
  DYNVOX_MOTION_STATE_UNCERTAIN = 0,
  // The object stands.
  DYNVOX_MOTION_STATE_STATIC,
  // The object moves.
  DYNVOX_MOTION_STATE_DYNAMIC,
} DynvoxMotionState;

// End of a ray or a path.
typedef enum {
  // The way is free as far as was asked.
  DYNVOX_PATH_END_FREE = 0,
  // At a surface of the map.
  DYNVOX_PATH_END_SURFACE,
  // Cell that was never observed.
  DYNVOX_PATH_END_UNKNOWN,
} DynvoxPathEnd;

// A mapper; only ever behind a pointer.
typedef struct DynvoxMapper DynvoxMapper;

// Pose of a camera: a rotation as a quaternion of length 1 and a translation, camera to world.
// Camera axes: x right, y down, z forward.
typedef struct {
  // w, x, y, z.
  double rotation[4];
  // m.
  double translation_m[3];
} DynvoxPose;

// Inertial unit that is fixed to the left camera. In a zeroed struct `t_camera_unit` must be set;
// 0 of any other number takes its default.
typedef struct {
  // Unit's axes to those of the rectified left camera.
  DynvoxPose t_camera_unit;
  // Seconds to add to the samples' times so that they are on the camera's clock, -1 to 1; what
  // remains is found from the turns.
  double clock_offset_s;
  // Noise density of turn rates, rad/s/sqrt(Hz); 0.001 by default.
  double turn_density;
  // Bias of turn rates that the unit may begin with, one sigma, rad/s; 0.1 by default.
  double turn_bias_sigma;
  // Random walk of that bias, rad/s2/sqrt(Hz); 0.0001 by default.
  double turn_walk;
  // Constant error of the specific force, one sigma, m/s2; 0.03 by default.
  double force_bias_sigma;
  // Largest turn rate that an axis can show, rad/s; 34 by default.
  double turn_range;
  // Largest specific force that an axis can show, m/s2; 150 by default.
  double force_range;
} DynvoxInertialUnit;

// Two identical pinhole cameras, rectified.
typedef struct {
  // Focal length, px.
  double focal_px;
  // Principal point, px from the centre of the upper left pixel.
  double center_u_px;
  // Principal point, px from the centre of the upper left pixel.
  double center_v_px;
  // Distance between the cameras, m.
  double baseline_m;
} DynvoxRig;

// A lens by its model. Numbers as in dynvox's own table of models.
typedef uint32_t DynvoxLensModel;

// A camera as it is: its lens and the size of its images.
typedef struct {
  // Columns of its images, px, at most 4,096.
  uint32_t width;
  // Rows of its images, px, at most 4,096.
  uint32_t height;
  // Focal lengths, horizontal and vertical, px.
  double focal_px[2];
  // Principal point, px from the centre of the upper left pixel.
  double center_px[2];
  // DYNVOX_LENS_...
  DynvoxLensModel model;
  // Parameters of the model; those that it does not have are not read.
  double parameters[15];
} DynvoxRawCamera;

// Two cameras as they are, the motion between them, and the size their images are rectified to.
typedef struct {
  // The left camera.
  DynvoxRawCamera left;
  // The right camera.
  DynvoxRawCamera right;
  // Rotation of left camera coordinates to right ones, row by row.
  double r_right_left[9];
  // The left camera's centre in right camera coordinates, m.
  double t_right_left_m[3];
  // Columns of the rectified images, px; 0 where pairs come rectified.
  uint32_t width;
  // Rows of the rectified images, px.
  uint32_t height;
  // Focal length of the rectified images, px; 0 takes the least that shows no pixel without
  // image.
  double focal_px;
} DynvoxRawRig;

// Everything a mapper can be told, beside its bounds: the defaults for a rig, and what
// dynvox_config_set changed of them.
typedef struct {
  // The cameras; where pairs are raw, the rectified ones.
  DynvoxRig rig;
  // Raw cameras, if dynvox_config_raw named them.
  DynvoxRawRig raw;
  // Inertial unit, if dynvox_config_inertial named one.
  DynvoxInertialUnit inertial;
  // Bytes of `settings` in use.
  size_t settings_len;
  // Lines `key=value`, in the order they were set. Written by dynvox_config_set.
  uint8_t settings[DYNVOX_SETTINGS_BYTES];
} DynvoxConfig;

// Every bound of a mapper. Bytes follow from them alone. dynvox_capacity_of_profile and
// dynvox_capacity_for_budget fill it.
typedef struct {
  // Widest image, px.
  size_t image_width;
  // Highest image, px.
  size_t image_height;
  // Widest raw image that is rectified, px, at most 4,096; 0 where pairs come rectified.
  size_t raw_width;
  // Highest raw image, px.
  size_t raw_height;
  // Features kept for each image.
  size_t features;
  // Matches kept for each frame.
  size_t matches;
  // Voxel blocks of the static map.
  size_t blocks;
  // Blocks visible in one frame.
  size_t visible_blocks;
  // Frames the pruning window can span.
  size_t history_frames;
  // Detections in one frame, at most 64.
  size_t detections;
  // Words of 64 pixels for the masks of one frame.
  size_t mask_words;
  // Tracks.
  size_t tracks;
  // Objects reconstructed at once.
  size_t objects;
  // Voxel blocks of one object.
  size_t object_blocks;
  // Pixels of crops that wait for their object's motion.
  size_t crop_pixels;
  // Keyframes by which places are recognised, at most 65,536; 0 makes none, and then it costs no
  // byte.
  size_t keyframes;
  // Width of the planner's window, cells, at most 1,024; 0 makes none, and then it costs no
  // byte.
  size_t planning_width;
  // Length of the planner's window, cells.
  size_t planning_length;
  // Height of the planner's window, cells.
  size_t planning_height;
  // 1 if distances are kept for every cell of the window, 0 if for a slice only.
  uint8_t planning_distance_3d;
  // 1 if voxels have colour, else 0.
  uint8_t colour;
} DynvoxCapacity;

// Units of work by kind: of one step in a report, the most of any step from dynvox_work_bound.
typedef struct {
  // Pixels of the rows that are matched densely; none where disparities are given.
  uint64_t stereo_pixels;
  // Support points looked for, each over the whole range of disparities.
  uint64_t support_candidates;
  // Triangles of the support points of both images.
  uint64_t triangles;
  // Features kept in both images.
  uint64_t features;
  // Descriptors compared with that of a feature.
  uint64_t compared_descriptors;
  // Circles of matches that closed.
  uint64_t circles;
  // Pixels of pictures of the map that the step itself takes.
  uint64_t cast_pixels;
  // Blocks looked up because a ray ran through them.
  uint64_t block_requests;
  // Blocks that left the pool for others, and blocks loaded from the store.
  uint64_t moved_blocks;
  // Voxels of the blocks that a frame was fused into.
  uint64_t fused_voxels;
  // Voxels of the blocks that pruning visited.
  uint64_t pruned_voxels;
} DynvoxWork;

// A capacity by name. Numbers as in dynvox's own table of profiles.
typedef uint32_t DynvoxProfile;

// A number of bytes and what they are to hold. In `colour` and `objects` 0 leaves the answer to
// the rules: colour where 20,000 blocks with colour fit, objects in a fifth of what the image
// leaves.
typedef struct {
  // Bytes of the buffer.
  size_t bytes;
  // Widest image, px.
  size_t width;
  // Highest image, px.
  size_t height;
  // Widest raw image that is rectified, px; 0 where pairs come rectified.
  size_t raw_width;
  // Highest raw image, px.
  size_t raw_height;
  // Side of a voxel, m, as in the configuration; 0 is the default.
  float voxel_size_m;
  // Above 0: with colour; below 0: without.
  int32_t colour;
  // Above 0: objects reconstructed at once; below 0: none.
  int32_t objects;
} DynvoxBudget;

// An image of one byte a pixel, three for a colour image: red, green, blue.
typedef struct {
  // The upper left pixel; `stride` times `height - 1` and one row's pixels must be readable from
  // here on. Null: there is no such image.
  const uint8_t *pixels;
  // Pixels from one row to the next; bytes where samples are packed.
  size_t stride;
} DynvoxImage;

// Something a detector saw in the left image.
typedef struct {
  // 0 other, 1 car, 2 bus, 3 truck, 4 van, 5 train, 6 person, 7 rider, 8 bicycle, 9 motorcycle,
  // 10 animal, 11 moving object.
  uint8_t class_code;
  // Confidence of the detector, 0 to 1.
  float score;
  // First column of the box, px; may lie beside the image.
  int32_t left;
  // First row of the box, px; may lie beside the image.
  int32_t top;
  // Columns of the box, px.
  uint32_t width;
  // Rows of the box, px.
  uint32_t height;
  // `width` times `height` bytes, row by row; a pixel belongs to the object unless its byte is
  // 0.
  const uint8_t *mask;
} DynvoxDetection;

// Turn rate and specific force at one time, in the unit's own axes.
typedef struct {
  // Time, ns, on the clock of the frames' times.
  uint64_t time_ns;
  // Turn rates about the unit's axes, rad/s.
  double turn_rate[3];
  // Specific force along the unit's axes, m/s2, gravity included: a unit at rest shows 9.8 along
  // the axis that points up.
  double force[3];
} DynvoxInertialSample;

// Arrangement of the samples of an image.
typedef uint32_t DynvoxSampleLayout;

// A stereo pair and what is known of it, rectified, or raw where the configuration is
// dynvox_config_raw's. Everything is read during the call alone.
typedef struct {
  // Width of every image, px; disparities and ignored pixels of raw pairs have the size of the
  // rectified images.
  size_t width;
  // Height of every image, px; as above.
  size_t height;
  // Left grey image.
  DynvoxImage left;
  // Right grey image.
  DynvoxImage right;
  // Left image in colour, or null pixels.
  DynvoxImage colour;
  // Detections in any order; null without detections.
  const DynvoxDetection *detections;
  // Number of detections.
  size_t detection_count;
  // Pose of the left camera in the world, if known; null lets the mapper estimate it.
  const DynvoxPose *t_world_camera;
  // Time of the pair, ns since any moment that stays the same, rising from frame to frame; null
  // if unknown: then "tracking.frame_interval_s" has passed since the frame before.
  const uint64_t *time_ns;
  // Disparity of the left pixels in 1/256 px, 0 where it is unknown, a value for each pixel
  // without padding; null lets the mapper match the pair.
  const uint16_t *disparity_q8;
  // Samples of the configuration's inertial unit since the frame before, in order of time; at
  // most 1,024 are read. Null without samples; they need `time_ns`.
  const DynvoxInertialSample *inertial;
  // Number of samples.
  size_t inertial_count;
  // DYNVOX_SAMPLES_..., the arrangement of the samples of `left` and `right`. Packed ones need a
  // mapper that rectifies: DYNVOX_STATUS_SIZE from others.
  DynvoxSampleLayout layout;
  // Pixels of the left image that no stage uses, marked by any value but 0: the car's own
  // bonnet, a dirty lens. Null pixels: none.
  DynvoxImage ignored;
} DynvoxFrame;

// An evicted block of 8 x 8 x 8 voxels; x runs fastest, then y, then z. Valid during the call.
typedef struct {
  // Coordinates in the segment's lattice, blocks.
  int16_t coord[3];
  // Number of the map's segment that the block is of; a segment has a lattice of its own.
  uint16_t segment;
  // 512 signed distances, 1/32767 of the truncation.
  const int16_t *sdf;
  // 512 weights.
  const uint8_t *weight;
  // 512 reds, greens and blues, plane by plane; null where the map has no colour.
  const uint8_t *colour;
} DynvoxBlock;

// A block that becomes visible again, all zero, to be filled from the store. Valid during the
// call.
typedef struct {
  // Coordinates in the segment's lattice, blocks.
  int16_t coord[3];
  // Number of the map's segment that the block is of; a segment has a lattice of its own.
  uint16_t segment;
  // 512 signed distances.
  int16_t *sdf;
  // 512 weights.
  uint8_t *weight;
  // 512 reds, greens and blues, plane by plane; null where the map has no colour.
  uint8_t *colour;
} DynvoxLoadedBlock;

// The caller's store of blocks. Called on the thread of the step, which waits for it; must not
// call the same mapper, which answers DYNVOX_STATUS_BUSY then.
typedef struct {
  // Handed to both functions.
  void *context;
  // Stores an evicted block; the last one stored with its segment and coordinates counts. False
  // when it cannot: the block is lost, and counted. Null: all are lost.
  bool (*store)(void *context, const DynvoxBlock *block);
  // Fills a block; false when none is stored with its segment and coordinates. Null: none is.
  bool (*load)(void *context, const DynvoxLoadedBlock *block);
} DynvoxStore;

// Use of the inertial unit in a step, and what is known of it. All 0 without a unit.
typedef struct {
  // Samples that came with the frame.
  uint32_t samples;
  // Samples that were not read: beyond 1,024, not finite, or not later than those before.
  uint32_t ignored;
  // Gaps between samples that were bridged.
  uint32_t bridged;
  // True if the unit is trusted: its turns agree with those that images show.
  bool trusted;
  // Reason not to use it.
  DynvoxInertialDoubt doubt;
  // True if a pose that images did not give was turned by it.
  bool turned;
  // True if a turn that images showed was refused: it contradicts the unit's.
  bool refused;
  // Bias of the turn rates, rad/s.
  float turn_bias[3];
  // Standard deviation of the least known bias, rad/s.
  float turn_bias_sigma;
  // Seconds to add to the samples' times.
  float clock_offset_s;
  // Standard deviation of the offset, s: large until the camera changed its turn.
  float clock_offset_sigma_s;
  // Unit vector that points up, in the world of `t_world_camera`; zeros while it is unknown.
  float up_world[3];
  // Standard deviation of its angle, rad.
  float up_sigma_rad;
} DynvoxInertialReport;

// Report of one step.
typedef struct {
  // Number of the frame, from 0.
  uint32_t frame;
  // The worst that happened.
  DynvoxSeverity severity;
  // Pose of the left camera in the world, which is that of its segment of the map.
  DynvoxPose t_world_camera;
  // Origin of the pose.
  DynvoxPoseOrigin pose_origin;
  // Covariance of the motion since the frame it was matched with, row by row: rotation vector
  // (rad), then translation (m), in this camera's axes. A slow camera's is that since an older
  // frame, and does not add up from frame to frame. All 0 where no motion was estimated.
  double motion_covariance[36];
  // True if something of the frame was fused into the map: its pose is known, and it shows
  // depth.
  bool fused;
  // Number of the map's segment, from 0: another one begins where the camera was lost and is not
  // found again, with that camera as its world. Where one segment lies in another is not known.
  uint16_t segment;
  // Pixels with a disparity.
  uint32_t disparities;
  // Matches the camera's motion rests on.
  uint32_t inliers;
  // Blocks in use.
  uint32_t blocks;
  // Most blocks ever in use.
  uint32_t blocks_peak;
  // Blocks the pool holds.
  uint32_t blocks_capacity;
  // Blocks refused in this step: pool full, or beyond the map.
  uint32_t blocks_refused;
  // Blocks evicted and stored in this step.
  uint32_t blocks_stored;
  // Blocks evicted and lost in this step.
  uint32_t blocks_lost;
  // Voxels that pruning reset.
  uint32_t voxels_reset;
  // Digest of what went in: the same pictures give the same number everywhere.
  uint64_t input_digest;
  // Digest of all that came of the step: the same frames and configuration give the same number
  // everywhere.
  uint64_t digest;
  // The inertial unit.
  DynvoxInertialReport inertial;
  // Work of the step.
  DynvoxWork work;
  // Visible blocks that the frame was not fused into because of "mapper.work_budget", all of
  // them farther than those it was.
  uint32_t fused_blocks_deferred;
  // Blocks that pruning leaves to a later frame because of it.
  uint32_t pruned_blocks_deferred;
  // True if loops that were closed changed poses of keyframes in this frame. The camera and the
  // map go on in the world as it was driven.
  bool world_moved;
} DynvoxReport;

// An object that leaves. Valid during the call.
typedef struct {
  // Number of its track.
  uint32_t id;
  // Number of the trajectory segment within the track.
  uint32_t segment_id;
  // Class of the object, as in DynvoxDetection.
  uint8_t class_code;
  // Motion state of the object.
  DynvoxMotionState state;
  // First frame it was fused in.
  uint32_t first_frame;
  // Last frame it was fused in.
  uint32_t last_frame;
  // Frames it was fused in.
  uint32_t frames;
  // Blocks of its volume.
  uint32_t blocks;
  // Pose of the object in the world when it was fused last.
  DynvoxPose t_world_object;
  // For dynvox_retired_triangles.
  const void *volume;
} DynvoxRetired;

// The caller's sink for objects that leave. Called on the thread of the step, which waits for it;
// must not call the same mapper.
typedef struct {
  // Handed to the function.
  void *context;
  // Takes an object. Null: none is reported.
  void (*retire)(void *context, const DynvoxRetired *object);
} DynvoxObjectSink;

// A disparity image: buffers of the caller, either may be null. It has the size of the frames; its
// rows follow each other without padding.
typedef struct {
  // Pixels that each buffer holds, unless it is null.
  size_t capacity;
  // Disparity in 1/256 px; 0 where it is unknown. Odd values of a pair that the mapper matched
  // itself were filled in between measured ones, which are even.
  uint16_t *disparity_q8;
  // Confidence, 1 to 255: one more than the number of measured pixels in the 16 x 16 about it; 0
  // where there is no disparity.
  uint8_t *confidence;
  // Written: columns.
  size_t width;
  // Written: rows.
  size_t height;
  // Written: true if there is a confidence. It needs the setting stereo.min_confidence above 0,
  // and pairs that the mapper matched itself.
  bool has_confidence;
} DynvoxDisparity;

// A rendered view of the map: buffers of the caller, any may be null. The view has the size of the
// frames; its rows follow each other without padding.
typedef struct {
  // Pixels that each buffer holds, unless it is null.
  size_t capacity;
  // Depth, m; 0 where there is no surface.
  float *depth_m;
  // Three bytes a pixel: the surface's normal in camera axes, towards the camera, 1/127.
  int8_t *normal;
  // Three bytes a pixel: red, green, blue.
  uint8_t *colour;
  // Number of observations of the surface.
  uint8_t *weight;
  // Written: columns.
  size_t width;
  // Written: rows.
  size_t height;
} DynvoxPicture;

// A corner of a triangle.
typedef struct {
  // Position in the world of the camera's segment, m.
  float position_m[3];
  // Red, green, blue.
  uint8_t colour[3];
} DynvoxVertex;

// A triangle of the map's surface, its corners counter-clockwise seen from free space.
typedef struct {
  // The corners.
  DynvoxVertex vertices[3];
} DynvoxTriangle;

// Takes triangles one by one. Must not call the same mapper.
typedef void (*DynvoxTriangleSink)(void *context, const DynvoxTriangle *triangle);

// A track as it stands after a frame.
typedef struct {
  // Id of the track, from 1, never used again.
  uint32_t id;
  // Class of the object, as in DynvoxDetection.
  uint8_t class_code;
  // 1 if the track was detected in this frame, else 0.
  uint8_t detected;
  // 1 if the motion was measured in this frame, 0 if it is extrapolated.
  uint8_t measured;
  // 1 if `t_world_object` is known, else 0.
  uint8_t has_pose;
  // Motion state of the object.
  DynvoxMotionState state;
  // Score of its last detection.
  float score;
  // First frame it was detected in.
  uint32_t first_frame;
  // Last frame it was detected in.
  uint32_t last_frame;
  // First column of its box, px.
  int32_t left;
  // First row of its box, px.
  int32_t top;
  // Columns of its box, px.
  int32_t width;
  // Rows of its box, px.
  int32_t height;
  // Speed over ground, m/s; negative while no motion was ever measured.
  float speed_m_s;
  // Standard deviation of the speed, m/s.
  float speed_sigma_m_s;
  // Centre of its matches in the world, m.
  double center_world_m[3];
  // Pose of the object in the world.
  DynvoxPose t_world_object;
  // Matches assigned to it in this frame.
  uint32_t matches;
  // Inliers of its motion among them.
  uint32_t inliers;
  // Blocks of its volume; 0 where it is not reconstructed.
  uint32_t blocks;
} DynvoxTrack;

// The planner's window from above: buffers of the caller, any may be null. Columns are in rows
// from the nearest ahead to the farthest, in each row from left to right; cells of a column follow
// each other upwards.
typedef struct {
  // Columns that each buffer of columns holds, unless it is null.
  size_t columns_capacity;
  // Cells that `cells` holds, unless it is null.
  size_t cells_capacity;
  // State of each column between the configured heights: 0 unknown, 1 free, 2 occupied.
  uint8_t *state;
  // Distance to the nearest obstacle, m, below 0 inside one; the largest float without an
  // obstacle.
  float *distance_m;
  // Height of the ground, m; the largest float where none was found.
  float *height_m;
  // Rise over run of the ground; the largest float where it is not known.
  float *slope;
  // Height of the step through the column, m.
  float *step_m;
  // State of each cell: 0 unknown, 1 free, 2 occupied.
  uint8_t *cells;
  // Written: cells to the right, ahead and upwards.
  size_t size[3];
  // Written: a cell's side, m.
  double cell_m;
  // Written: where the first cell begins, m to the right, ahead and upwards of the world's
  // origin.
  double origin_m[3];
  // Written: the world's coordinates of a metre to the right, ahead and upwards, in this order.
  double axes_world[3][3];
} DynvoxWindow;

// A moving object in the window's axes: to the right, ahead, upwards of the world's origin.
typedef struct {
  // Number of its track.
  uint32_t id;
  // Frames since it was last seen.
  uint32_t unseen_frames;
  // Centre, m.
  float center_m[3];
  // Half its sides, m: along its heading, across it, upwards.
  float half_m[3];
  // Heading, a unit vector: right, ahead.
  float heading[2];
  // Velocity, m/s: right, ahead.
  float velocity_m_s[2];
  // Error of the centre, one sigma, m.
  float sigma_m;
  // Error of the velocity, one sigma, m/s.
  float sigma_m_s;
} DynvoxMovingBox;

// A ray or a path, as far as it is free.
typedef struct {
  // End of the free part.
  DynvoxPathEnd end;
  // Length of the free part, m.
  double free_m;
} DynvoxFreePath;

// A robot that moves along a path: an upright cylinder.
typedef struct {
  // Radius of the robot, m.
  double radius_m;
  // From this height over the path, m, on surfaces are in its way.
  double low_m;
  // Up to this one.
  double high_m;
  // 1 if cells that were never observed end the path as well, else 0.
  uint8_t unknown_ends;
} DynvoxRobotCylinder;

// Takes the next bytes of a snapshot; false when it cannot. Must not call the same mapper.
typedef bool (*DynvoxWrite)(void *context, const uint8_t *bytes, size_t len);

// Fills `bytes` with the next `len` bytes of a snapshot; false when there are not as many.
typedef bool (*DynvoxRead)(void *context, uint8_t *bytes, size_t len);

// Memory of two kinds for one mapper; both buffers begin at a multiple of dynvox_alignment(), and
// they do not overlap.
typedef struct {
  // Fast memory, for what each frame works on.
  uint8_t *hot;
  // Bytes of `hot`.
  size_t hot_len;
  // Large memory, for the map.
  uint8_t *cold;
  // Bytes of `cold`.
  size_t cold_len;
} DynvoxTwoBuffers;

// A byte for each sample (RAW8).
#define DYNVOX_SAMPLES_BYTES 0

// Five bytes for four samples (RAW10): a row has 5 bytes for each group of four, a last group that
// is not full included.
#define DYNVOX_SAMPLES_PACKED_10 1

// Three bytes for two samples (RAW12), counted likewise.
#define DYNVOX_SAMPLES_PACKED_12 2

// Below 8 MiB, images up to 320 x 96, no colour.
#define DYNVOX_PROFILE_TINY 0

// Below 64 MiB, images up to 640 x 192, no colour.
#define DYNVOX_PROFILE_SMALL 1

// Below 256 MiB, images up to 1280 x 384, colour.
#define DYNVOX_PROFILE_ONBOARD 2

// Below 2 GiB, images up to 1920 x 1088, colour.
#define DYNVOX_PROFILE_DESKTOP 3

// Pinhole with radial and tangential distortion; parameters k1 to k6, p1, p2.
#define DYNVOX_LENS_RADIAL_TANGENTIAL 0

// Equidistant fisheye (Kannala, Brandt); parameters k1 to k4.
#define DYNVOX_LENS_EQUIDISTANT 1

// Double sphere; parameters xi, alpha.
#define DYNVOX_LENS_DOUBLE_SPHERE 2

// Extended unified; parameters alpha, beta.
#define DYNVOX_LENS_EXTENDED_UNIFIED 3

// Mei's sphere with OpenCV's whole distortion; parameters xi, k1 to k6, p1, p2, s1 to s4, tilt
// about x and y.
#define DYNVOX_LENS_GENERAL 4

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// A sentence for a status, in static memory; "no such status" for another number.
const char *dynvox_status_text(uint32_t status);

// Adds an inertial unit to a configuration, whose frames then bring its samples. A unit that
// cannot be used is DYNVOX_STATUS_POSE or DYNVOX_STATUS_CONFIG.
//
// # Safety
// `unit` is null or points to a unit, `config` is null or points to a configuration from
// dynvox_config_default or dynvox_config_raw.
DynvoxStatus dynvox_config_inertial(const DynvoxInertialUnit *unit, DynvoxConfig *config);

// Writes the most units of work that any step of such a mapper does on any input.
//
// # Safety
// `capacity` is null or points to a capacity, `config` is null or points to a configuration,
// `bound` is null or points to units of work.
DynvoxStatus dynvox_work_bound(const DynvoxCapacity *capacity,
                               const DynvoxConfig *config,
                               DynvoxWork *bound);

// Writes all defaults for a rig.
//
// # Safety
// `rig` is null or points to a rig, `config` is null or points to a configuration.
DynvoxStatus dynvox_config_default(const DynvoxRig *rig, DynvoxConfig *config);

// Sets one setting by its dotted key: dynvox_config_set(&config, "volume.voxel_size_m", "0.05").
// Keys and values are those of a run's config.toml; choices stand without quotes. The time between
// two frames is "tracking.frame_interval_s". Whether a value is in its range,
// dynvox_config_problem says.
//
// # Safety
// `config` is null or points to a configuration from dynvox_config_default, `key` and `value` are
// null or text that ends in a zero byte.
DynvoxStatus dynvox_config_set(DynvoxConfig *config, const char *key, const char *value);

// Writes the first problem of a configuration as text that ends in a zero byte, truncated to `len`
// bytes; the empty text without a problem.
//
// # Safety
// `config` is null or points to a configuration, `text` is null or to `len` bytes.
DynvoxStatus dynvox_config_problem(const DynvoxConfig *config, char *text, size_t len);

// Writes the bounds of a profile.
//
// # Safety
// `capacity` is null or points to a capacity.
DynvoxStatus dynvox_capacity_of_profile(DynvoxProfile profile, DynvoxCapacity *capacity);

// Divides a buffer between the stages: writes the largest capacity for which dynvox_bytes is at
// most `budget->bytes`. Of too few bytes DYNVOX_STATUS_TOO_SMALL, and the least that works is
// written to `least`, which may be null.
//
// # Safety
// `budget` is null or points to a budget, `capacity` is null or points to a capacity, `least` is
// null or points to a number.
DynvoxStatus dynvox_capacity_for_budget(const DynvoxBudget *budget,
                                        DynvoxCapacity *capacity,
                                        size_t *least);

// Alignment of a mapper's buffer, bytes.
size_t dynvox_alignment(void);

// Writes how many bytes of buffer a mapper of that capacity takes.
//
// # Safety
// `capacity` is null or points to a capacity, `bytes` is null or points to a number.
DynvoxStatus dynvox_bytes(const DynvoxCapacity *capacity, size_t *bytes);

// Makes a mapper in `buffer` and writes its handle to `mapper`. The buffer is the mapper's until
// dynvox_destroy: nothing else may read, write, move or free it. What it holds before does not
// matter: a mapper that lived there ends, its handle is then the new one's. Takes less than 40 KiB
// of stack, as a step does.
//
// # Safety
// `capacity` is null or points to a capacity, `config` is null or points to a configuration,
// `buffer` is null or points to `len` bytes used by nothing else, `mapper` is null or points to a
// pointer.
DynvoxStatus dynvox_create(const DynvoxCapacity *capacity,
                           const DynvoxConfig *config,
                           uint8_t *buffer,
                           size_t len,
                           DynvoxMapper **mapper);

// Ends a mapper; its buffer is the caller's again. Read the map out before.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there.
DynvoxStatus dynvox_destroy(DynvoxMapper *mapper);

// Processes one frame, on the calling thread: depth, motion, map. Evicted blocks go to `store`, or
// are lost and counted where it is null. What was refused is counted in `report`, which may be
// null.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `frame` is null or points to a frame whose images, detections and masks are as large as
// it says; `store` is null or points to a store; `report` is null or points to a report.
DynvoxStatus dynvox_step(DynvoxMapper *mapper,
                         const DynvoxFrame *frame,
                         const DynvoxStore *store,
                         DynvoxReport *report);

// Steps like dynvox_step; objects that leave the mapper within the step go to `objects`, which may
// be null.
//
// # Safety
// As dynvox_step; `objects` is null or points to a sink.
DynvoxStatus dynvox_step_with(DynvoxMapper *mapper,
                              const DynvoxFrame *frame,
                              const DynvoxStore *store,
                              const DynvoxObjectSink *objects,
                              DynvoxReport *report);

// Writes the left camera's pose in the last frame; the identity before the first.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `pose` is null or points to a pose.
DynvoxStatus dynvox_pose(DynvoxMapper *mapper, DynvoxPose *pose);

// Copies the disparity of the last frame and its confidence.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `disparity` is null or points to an image whose buffers are as large as it says and
// overlap nothing.
DynvoxStatus dynvox_disparity(DynvoxMapper *mapper, DynvoxDisparity *disparity);

// Renders the static map in the camera's segment from a pose in it.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `pose` is null or points to a pose; `picture` is null or points to a picture whose
// buffers are as large as it says and overlap nothing.
DynvoxStatus dynvox_raycast(DynvoxMapper *mapper, const DynvoxPose *pose, DynvoxPicture *picture);

// Hands every triangle of the static map in the camera's segment to `sink`, and writes how many
// there were to `count`, which may be null.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `count` is null or points to a number.
DynvoxStatus dynvox_triangles(DynvoxMapper *mapper,
                              DynvoxTriangleSink sink,
                              void *context,
                              uint64_t *count);

// Evicts every block of the static map into `store`, which holds the entire map then. Writes the
// number of stored blocks to `stored` and of those the store refused to `lost`; either may be
// null.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `store` is null or points to a store; `stored` and `lost` are null or point to a
// number.
DynvoxStatus dynvox_stream_out(DynvoxMapper *mapper,
                               const DynvoxStore *store,
                               uint32_t *stored,
                               uint32_t *lost);

// Ends a sequence: prunes what is still in the window. Objects are lost; see dynvox_finish_with.
// The map can be rendered and read out as before.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it.
DynvoxStatus dynvox_finish(DynvoxMapper *mapper);

// Finishes like dynvox_finish; the objects that are still in the mapper leave to `objects`, which
// may be null.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `objects` is null or points to a sink.
DynvoxStatus dynvox_finish_with(DynvoxMapper *mapper, const DynvoxObjectSink *objects);

// Writes a pose as the upper three rows of its matrix, row by row: twelve numbers.
//
// # Safety
// `pose` is null or points to a pose, `matrix` is null or points to twelve numbers.
DynvoxStatus dynvox_pose_matrix(const DynvoxPose *pose, double *matrix);

// Writes the change from the world as it is driven to the one after all loops and fixes, at the
// camera: ROS's transform from `map` to `odom`. Reports, planning maps and objects are in the
// world as driven, which never jumps.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `change` is null or points to a pose.
DynvoxStatus dynvox_closed_world(DynvoxMapper *mapper, DynvoxPose *change);

// Takes a pose of the camera in the last frame that something else measured, in the world of the
// first camera, with its covariance row by row: rotation (rad), then translation (m), in the
// camera's axes. Like a loop it moves the keyframes, ten frames later; one that all else
// contradicts is taken out. The camera goes on in the world as driven.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `pose` is null or points to a pose; `covariance` is null or points to 36 numbers.
DynvoxStatus dynvox_add_fix(DynvoxMapper *mapper, const DynvoxPose *pose, const double *covariance);

// Takes a position of the camera in the last frame, m, with its standard deviations along the axes
// of the world, m, as dynvox_add_fix takes a pose.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `position_m` and `sigma_m` are null or point to three numbers each.
DynvoxStatus dynvox_add_position(DynvoxMapper *mapper,
                                 const double *position_m,
                                 const double *sigma_m);

// Takes the direction that is up in the last frame, in the camera's axes and in those of the first
// camera, with the standard deviation of its angle, rad, as dynvox_add_fix takes a pose. It holds
// roll and pitch, and with them the height of a long way.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `up_camera` and `up_world` are null or point to three numbers each.
DynvoxStatus dynvox_add_vertical(DynvoxMapper *mapper,
                                 const double *up_camera,
                                 const double *up_world,
                                 double sigma_rad);

// Writes the tracks of the last frame, at most `capacity` of them, and to `count` how many there
// are.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `tracks` is null or points to `capacity` tracks; `count` is null or points to a number.
DynvoxStatus dynvox_tracks(DynvoxMapper *mapper,
                           DynvoxTrack *tracks,
                           size_t capacity,
                           size_t *count);

// Hands every triangle of a reconstructed object to `sink`, in the object's own frame
// (`t_world_object` of its track brings it to the world), and writes how many there were to
// `count`, which may be null. DYNVOX_STATUS_UNKNOWN where the track is not reconstructed now.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `count` is null or points to a number.
DynvoxStatus dynvox_object_triangles(DynvoxMapper *mapper,
                                     uint32_t track_id,
                                     DynvoxTriangleSink sink,
                                     void *context,
                                     uint64_t *count);

// Reads the map into the planner's window, with moving objects where they will be `ahead_s`
// seconds after the last frame, and copies it to `window`. Of a capacity without a window its size
// is 0.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `window` is null or points to a window whose buffers are as large as it says and
// overlap nothing.
DynvoxStatus dynvox_update_planning_maps(DynvoxMapper *mapper, float ahead_s, DynvoxWindow *window);

// Writes the moving objects of the last dynvox_update_planning_maps, where they were in the last
// frame, at most `capacity` of them, and to `count` how many there are.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `boxes` is null or points to `capacity` boxes, `count` is null or points to a number.
DynvoxStatus dynvox_moving_boxes(DynvoxMapper *mapper,
                                 DynvoxMovingBox *boxes,
                                 size_t capacity,
                                 size_t *count);

// Follows a ray of the world from `origin_m` in `direction` (three numbers each, the direction of
// any length), at most `far_m`, to the first surface or unknown place.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `origin_m` and `direction` are null or point to three numbers, `free_path` is null or
// points to a free path.
DynvoxStatus dynvox_ray(DynvoxMapper *mapper,
                        const double *origin_m,
                        const double *direction,
                        double far_m,
                        DynvoxFreePath *free_path);

// Measures how far a robot may follow a polyline of `count` world points on the ground, three
// numbers each, before it touches a surface.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it; `points_m` is null or points to three times `count` numbers, `robot` is null or points
// to a robot, `free_path` is null or points to a free path.
DynvoxStatus dynvox_sweep(DynvoxMapper *mapper,
                          const double *points_m,
                          size_t count,
                          const DynvoxRobotCylinder *robot,
                          DynvoxFreePath *free_path);

// Writes all defaults for raw cameras, whose pairs the mapper rectifies: frames then have the size
// of the raw images, and the capacity's `raw_width` and `raw_height` bound it. The rectified rig
// is in the configuration. DYNVOX_STATUS_CONFIG where the calibration cannot be used.
//
// # Safety
// `rig` is null or points to a rig, `config` is null or points to a configuration.
DynvoxStatus dynvox_config_raw(const DynvoxRawRig *rig, DynvoxConfig *config);

// Hands every triangle of an object that leaves to `sink`, in the object's own frame, and writes
// how many there were to `count`, which may be null. Only within the call that reports the object.
//
// # Safety
// `object` is null or what the caller's DynvoxObjectSink was handed, within that call; `count` is
// null or points to a number.
DynvoxStatus dynvox_retired_triangles(const DynvoxRetired *object,
                                      DynvoxTriangleSink sink,
                                      void *context,
                                      uint64_t *count);

// Writes the whole state of a mapper, but for blocks that a store holds. The mapper continues as
// before. DYNVOX_STATUS_CALLBACK when `write` refused.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread
// uses it.
DynvoxStatus dynvox_save(DynvoxMapper *mapper, DynvoxWrite write, void *context);

// Creates a mapper like dynvox_create, in the state in which dynvox_save was called: capacity and
// configuration must be those of the saved one. From a damaged or foreign snapshot
// (DYNVOX_STATUS_SNAPSHOT), or when `read` refused (DYNVOX_STATUS_CALLBACK), no mapper is made;
// then `mapper` is as it was, and the buffer holds no mapper at all: one that lived there has
// ended, and its handle answers DYNVOX_STATUS_NO_MAPPER.
//
// # Safety
// As dynvox_create.
DynvoxStatus dynvox_restore(const DynvoxCapacity *capacity,
                            const DynvoxConfig *config,
                            uint8_t *buffer,
                            size_t len,
                            DynvoxRead read,
                            void *context,
                            DynvoxMapper **mapper);

// Writes how many bytes of two buffers a mapper of that capacity takes.
//
// # Safety
// `capacity` is null or points to a capacity, `hot` and `cold` are null or point to a number.
DynvoxStatus dynvox_bytes_in_two(const DynvoxCapacity *capacity, size_t *hot, size_t *cold);

// Makes a mapper like dynvox_create in two buffers, with the same results. Both are the mapper's
// until dynvox_destroy.
//
// # Safety
// `capacity` is null or points to a capacity, `config` is null or points to a configuration,
// `buffers` is null or points to two buffers that are as long as it says and used by nothing else,
// `mapper` is null or points to a pointer.
DynvoxStatus dynvox_create_in_two(const DynvoxCapacity *capacity,
                                  const DynvoxConfig *config,
                                  const DynvoxTwoBuffers *buffers,
                                  DynvoxMapper **mapper);

// Restores a mapper like dynvox_restore in two buffers, wherever the saved one lay.
//
// # Safety
// `capacity` is null or points to a capacity, `config` is null or points to a configuration,
// `buffers` is null or points to two buffers that are as long as it says and used by nothing else,
// `mapper` is null or points to a pointer.
DynvoxStatus dynvox_restore_in_two(const DynvoxCapacity *capacity,
                                   const DynvoxConfig *config,
                                   const DynvoxTwoBuffers *buffers,
                                   DynvoxRead source,
                                   void *context,
                                   DynvoxMapper **mapper);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* DYNVOX_H */
