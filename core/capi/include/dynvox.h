// dynvox for C: stereo dense mapping in one buffer of the caller's.
//
//   size_t bytes;
//   dynvox_bytes(DYNVOX_PROFILE_TINY, &bytes);
//   uint8_t *buffer = aligned_alloc(dynvox_alignment(), bytes);     // or a static array, aligned
//   DynvoxConfig config;
//   dynvox_config_default(&rig, &config);
//   DynvoxMapper *mapper;
//   if (dynvox_create(DYNVOX_PROFILE_TINY, &config, buffer, bytes, &mapper) != DYNVOX_STATUS_OK) { ... }
//   while (next(&frame)) dynvox_step(mapper, &frame, NULL, &report);
//   dynvox_triangles(mapper, print, NULL, NULL);
//   dynvox_destroy(mapper);
//
// Ownership: the buffer is the mapper's from dynvox_create to dynvox_destroy; nothing else may touch, move or free it meanwhile. All other
// arguments are read, or written, during the call only. Nothing is ever allocated, and nothing of a mapper lies elsewhere.
// Alignment: the buffer begins at a multiple of dynvox_alignment(); everything else at its type's.
// Threads: a mapper may move between threads, but one at a time may use it; mappers are independent. There are no globals.
// Callbacks run on the calling thread and must not call their own mapper.
// Errors: every function returns DYNVOX_STATUS_OK or the reason; dynvox_status_text turns it into a sentence. Null pointers, misalignment, wrong
// sizes, numbers that are not finite, and calls from a callback are statuses. Undefined, as everywhere in C: pointers to less memory than they
// say, handles whose buffer is gone, two threads in one mapper.
//
// Written by cbindgen from core/capi/src; DYNVOX_BLESS=1 cargo test -p dynvox-capi --test header writes it anew.


#ifndef DYNVOX_H
#define DYNVOX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The result of a call. A call that does not return DYNVOX_STATUS_OK has changed nothing.
typedef enum {
  // Done.
  DYNVOX_STATUS_OK = 0,
  // A pointer that must not be null is.
  DYNVOX_STATUS_NULL,
  // The buffer does not begin at a multiple of dynvox_alignment(), or another pointer not at one of its type's.
  DYNVOX_STATUS_MISALIGNED,
  // The buffer or an output is too small.
  DYNVOX_STATUS_TOO_SMALL,
  // The handle is not that of a mapper: never created, or destroyed.
  DYNVOX_STATUS_NO_MAPPER,
  // The call came from within a callback of the same mapper.
  DYNVOX_STATUS_BUSY,
  // A frame's memory lies within the mapper's buffer.
  DYNVOX_STATUS_OVERLAP,
  // An unknown profile, class or track.
  DYNVOX_STATUS_UNKNOWN,
  // The configuration cannot be used: dynvox_config_problem says why. A calibration that is not finite is one reason.
  DYNVOX_STATUS_CONFIG,
  // A pose is not finite, its rotation is not of length 1, or it lies beyond the map.
  DYNVOX_STATUS_POSE,
  // An image is larger than the profile allows, too small to match, or its stride is below its width.
  DYNVOX_STATUS_SIZE,
  // A frame's size differs from that of the frames before.
  DYNVOX_STATUS_SIZE_CHANGED,
  // More detections than a frame can have (64).
  DYNVOX_STATUS_TOO_MANY,
  // No frame yet.
  DYNVOX_STATUS_NO_FRAME,
} DynvoxStatus;

// How much a step's events matter.
typedef enum {
  // Nothing to say.
  DYNVOX_SEVERITY_INFO = 0,
  // Something went wrong and was made good within the frame.
  DYNVOX_SEVERITY_RECOVERED,
  // The map lacks what it should hold, or the pose is a guess.
  DYNVOX_SEVERITY_MAP_AFFECTED,
} DynvoxSeverity;

// A mapper; only ever behind a pointer.
typedef struct DynvoxMapper DynvoxMapper;

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

// The settings that are changed most often. dynvox_config_default fills it.
typedef struct {
  // The cameras.
  DynvoxRig rig;
  // Distance between voxels, m.
  float voxel_size_m;
  // Distance from a surface up to which voxels are kept, m.
  float truncation_m;
  // Nearest depth fused, m.
  float near_m;
  // Farthest depth fused, m.
  float far_m;
  // Voxels seen at most this often are reset when they leave the window; 0 is off.
  uint8_t prune_weight;
  // Length of the window, frames.
  uint32_t prune_lag;
  // Whether detections are tracked and kept out of the static map.
  bool dynamic;
} DynvoxConfig;

// Size of a mapper. Numbers as in dynvox's own table of profiles.
typedef uint32_t DynvoxProfile;

// An image of one byte a pixel, three for a colour image: red, green, blue.
typedef struct {
  // The upper left pixel; `stride` times `height - 1` and `width` pixels must be readable from here on. Null: there is no such image.
  const uint8_t *pixels;
  // Pixels from one row to the next.
  size_t stride;
} DynvoxImage;

// Something a detector saw in the left image.
typedef struct {
  // 0 other, 1 car, 2 bus, 3 truck, 4 van, 5 train, 6 person, 7 rider, 8 bicycle, 9 motorcycle, 10 animal.
  uint8_t class_code;
  // How sure the detector is, 0 to 1.
  float score;
  // First column of the box, px; may lie beside the image.
  int32_t left;
  // First row of the box, px; may lie beside the image.
  int32_t top;
  // Columns of the box, px.
  uint32_t width;
  // Rows of the box, px.
  uint32_t height;
  // `width` times `height` bytes, row by row; a pixel belongs to the object unless its byte is 0.
  const uint8_t *mask;
} DynvoxDetection;

// Pose of a camera: a rotation as a quaternion of length 1 and a translation, camera to world. Camera axes: x right, y down, z forward.
typedef struct {
  // w, x, y, z.
  double rotation[4];
  // m.
  double translation_m[3];
} DynvoxPose;

// A rectified stereo pair and what is known of it. Everything is read during the call alone.
typedef struct {
  // Of every image, px.
  size_t width;
  // Of every image, px.
  size_t height;
  // Left grey image.
  DynvoxImage left;
  // Right grey image.
  DynvoxImage right;
  // Left image in colour, or null pixels.
  DynvoxImage colour;
  // Detections in any order; null without detections.
  const DynvoxDetection *detections;
  // How many.
  size_t detection_count;
  // Where the camera is, for those who know; null lets the mapper find out.
  const DynvoxPose *t_world_camera;
} DynvoxFrame;

// An evicted block of 8 x 8 x 8 voxels; x runs fastest, then y, then z. Valid during the call.
typedef struct {
  // Coordinates, blocks.
  int16_t coord[3];
  // 512 signed distances, 1/32767 of the truncation.
  const int16_t *sdf;
  // 512 weights.
  const uint8_t *weight;
  // 512 reds, greens and blues, plane by plane; null where the map has no colour.
  const uint8_t *colour;
} DynvoxBlock;

// A block that becomes visible again, all zero, to be filled from the store. Valid during the call.
typedef struct {
  // Coordinates, blocks.
  int16_t coord[3];
  // 512 signed distances.
  int16_t *sdf;
  // 512 weights.
  uint8_t *weight;
  // 512 reds, greens and blues, plane by plane; null where the map has no colour.
  uint8_t *colour;
} DynvoxLoadedBlock;

// The caller's store of blocks. Called on the thread of the step, which waits for it; must not call the same mapper, which answers
// DYNVOX_STATUS_BUSY then.
typedef struct {
  // Handed to both functions.
  void *context;
  // Stores an evicted block; the last one stored at its coordinates counts. False when it cannot: the block is lost, and counted. Null: all
  // are lost.
  bool (*store)(void *context, const DynvoxBlock *block);
  // Fills a block; false when none is stored at its coordinates. Null: none is.
  bool (*load)(void *context, const DynvoxLoadedBlock *block);
} DynvoxStore;

// What one step did.
typedef struct {
  // Number of the frame, from 0.
  uint32_t frame;
  // The worst that happened.
  DynvoxSeverity severity;
  // Where the left camera is.
  DynvoxPose t_world_camera;
  // Whether the frame went into the map.
  bool fused;
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
  // Blocks that left in this step and were kept by the store.
  uint32_t blocks_kept;
  // Blocks that left in this step and are lost.
  uint32_t blocks_lost;
  // Voxels that pruning reset.
  uint32_t voxels_pruned;
  // Digest of what went in: the same pictures give the same number everywhere.
  uint64_t input_digest;
  // Digest of all that came of the step: the same frames and configuration give the same number everywhere.
  uint64_t digest;
} DynvoxReport;

// A rendered view of the map: buffers of the caller, any may be null. The view has the size of the frames; its rows follow each other
// without padding.
typedef struct {
  // Pixels that each buffer holds, unless it is null.
  size_t capacity;
  // Depth, m; 0 where there is no surface.
  float *depth_m;
  // Three bytes a pixel: the surface's normal in the world, 1/127.
  int8_t *normal;
  // Three bytes a pixel: red, green, blue.
  uint8_t *colour;
  // How often the surface was observed.
  uint8_t *weight;
  // Written: columns.
  size_t width;
  // Written: rows.
  size_t height;
} DynvoxPicture;

// A corner of a triangle.
typedef struct {
  // Position in the world, m.
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

// Below 8 MiB, images up to 320 x 96, no colour.
#define DYNVOX_PROFILE_TINY 0

// Below 64 MiB, images up to 640 x 192, no colour.
#define DYNVOX_PROFILE_SMALL 1

// Below 256 MiB, images up to 1280 x 384, colour.
#define DYNVOX_PROFILE_ONBOARD 2

// Below 2 GiB, images up to 1920 x 1088, colour.
#define DYNVOX_PROFILE_DESKTOP 3

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// A sentence for a status, in static memory; "no such status" for another number.
const char *dynvox_status_text(uint32_t status);

// Writes all defaults for a rig.
//
// # Safety
// `rig` is null or points to a rig, `config` is null or points to a configuration.
DynvoxStatus dynvox_config_default(const DynvoxRig *rig, DynvoxConfig *config);

// Writes the first problem of a configuration as text that ends in a zero byte, truncated to `len` bytes; the empty text without a
// problem.
//
// # Safety
// `config` is null or points to a configuration, `text` is null or to `len` bytes.
DynvoxStatus dynvox_config_problem(const DynvoxConfig *config,
                                   char *text,
                                   size_t len);

// Alignment of a mapper's buffer, bytes.
size_t dynvox_alignment(void);

// Writes how many bytes of buffer a mapper of that profile takes.
//
// # Safety
// `bytes` is null or points to a number.
DynvoxStatus dynvox_bytes(DynvoxProfile profile, size_t *bytes);

// Makes a mapper in `buffer` and writes its handle to `mapper`. The buffer is the mapper's until dynvox_destroy: nothing else may read,
// write, move or free it. What it holds before does not matter. Takes less than 32 KiB of stack, as a step does.
//
// # Safety
// `config` is null or points to a configuration, `buffer` is null or points to `len` bytes used by nothing else, `mapper` is null or points to
// a pointer.
DynvoxStatus dynvox_create(DynvoxProfile profile,
                           const DynvoxConfig *config,
                           uint8_t *buffer,
                           size_t len,
                           DynvoxMapper **mapper);

// Ends a mapper; its buffer is the caller's again. Read the map out before.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there.
DynvoxStatus dynvox_destroy(DynvoxMapper *mapper);

// Processes one frame, on the calling thread: depth, motion, map. Evicted blocks go to `store`, or are lost and counted where it is null.
// What was refused is counted in `report`, which may be null.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread uses it; `frame` is null or points to a
// frame whose images, detections and masks are as large as it says; `store` is null or points to a store; `report` is null or points to
// a report.
DynvoxStatus dynvox_step(DynvoxMapper *mapper,
                         const DynvoxFrame *frame,
                         const DynvoxStore *store,
                         DynvoxReport *report);

// Writes the left camera's pose in the last frame; the identity before the first.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread uses it; `pose` is null or points to
// a pose.
DynvoxStatus dynvox_pose(DynvoxMapper *mapper,
                         DynvoxPose *pose);

// Renders the static map from a pose.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread uses it; `pose` is null or points to a
// pose; `picture` is null or points to a picture whose buffers are as large as it says and overlap nothing.
DynvoxStatus dynvox_raycast(DynvoxMapper *mapper,
                            const DynvoxPose *pose,
                            DynvoxPicture *picture);

// Hands every triangle of the static map to `sink`, and writes how many there were to `count`, which may be null.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread uses it; `count` is null or points to
// a number.
DynvoxStatus dynvox_triangles(DynvoxMapper *mapper,
                              DynvoxTriangleSink sink,
                              void *context,
                              uint64_t *count);

// Evicts every block of the static map into `store`, which holds the entire map then. Writes the number of stored blocks to `stored` and
// of those the store refused to `lost`; either may be null.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread uses it; `store` is null or points to a
// store; `stored` and `lost` are null or point to a number.
DynvoxStatus dynvox_stream_out(DynvoxMapper *mapper,
                               const DynvoxStore *store,
                               uint32_t *stored,
                               uint32_t *lost);

// Ends a sequence: prunes what is still in the window. The map can be rendered and read out as before.
//
// # Safety
// `mapper` is null or a handle from dynvox_create whose buffer is still there, and no other thread uses it.
DynvoxStatus dynvox_finish(DynvoxMapper *mapper);

// Writes a pose as the upper three rows of its matrix, row by row: twelve numbers.
//
// # Safety
// `pose` is null or points to a pose, `matrix` is null or points to twelve numbers.
DynvoxStatus dynvox_pose_matrix(const DynvoxPose *pose, double *matrix);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* DYNVOX_H */
