/* Maps a clip (dynvox fixtures pack FIXTURE --out clip.bin) and prints each frame's number and digest. The digests on file come of the bounds and
 * settings that the fixture is replayed with: BYTES of buffer, 0 for the profile tiny, and KEY=VALUE as in its settings.toml.
 *
 *   cargo build --release -p dynvox-capi
 *   cc -std=c11 -Icore/capi/include core/capi/examples/map_fixture.c target/release/libdynvox_capi.a -lm -lpthread -ldl -o map_fixture
 *   ./map_fixture clip.bin 0 volume.voxel_size_m=0.07 volume.prune_lag=8
 */
#include "dynvox.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What is left of the clip; fixtures/clip/src/lib.rs documents its bytes. */
static const uint8_t *at;

static uint32_t take_u32(void) {
  uint32_t value = (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
  at += 4;
  return value;
}

static float take_f32(void) {
  uint32_t bits = take_u32();
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static double take_f64(void) {
  uint64_t low = take_u32(), bits = low | (uint64_t)take_u32() << 32;
  double value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static void check(DynvoxStatus status, const char *what) {
  if (status != DYNVOX_STATUS_OK) {
    fprintf(stderr, "%s: %s\n", what, dynvox_status_text(status));
    exit(1);
  }
}

static void count(void *context, const DynvoxTriangle *triangle) {
  (void)triangle;
  ++*(uint64_t *)context;
}

static bool store_block(void *context, const DynvoxBlock *block) {
  (void)block;
  ++*(uint32_t *)context;
  return true;
}

static uint8_t *read_file(const char *path) {
  FILE *file = fopen(path, "rb");
  uint8_t *bytes = malloc(64u << 20);
  if (!file || !bytes || fread(bytes, 1, 64u << 20, file) < 56 || memcmp(bytes, "DVXCLIP1", 8) != 0) {
    fprintf(stderr, "%s is no clip\n", path);
    exit(1);
  }
  fclose(file);
  return bytes;
}

/* Objects that left, and their triangles. */
typedef struct {
  uint32_t objects;
  uint64_t triangles;
} Retired;

static void retire(void *context, const DynvoxRetired *object) {
  Retired *retired = context;
  uint64_t triangles = 0, reported = 0;
  check(dynvox_retired_triangles(object, count, &triangles, &reported), "retired");
  retired->objects += triangles == reported;
  retired->triangles += triangles;
}

int main(int argc, char **argv) {
  if (argc < 3) {
    fprintf(stderr, "map_fixture CLIP BYTES [KEY=VALUE...]\n");
    return 1;
  }
  uint8_t *clip = read_file(argv[1]);
  at = clip + 8;
  if (take_u32() != 0) {
    fprintf(stderr, "not a clip for the whole mapper\n");
    return 1;
  }
  size_t width = take_u32(), height = take_u32();
  uint32_t frames = take_u32();
  DynvoxRig rig;
  rig.focal_px = take_f64();
  rig.center_u_px = take_f64();
  rig.center_v_px = take_f64();
  rig.baseline_m = take_f64();

  DynvoxConfig config;
  check(dynvox_config_default(&rig, &config), "config");
  float voxel_size_m = 0.05f;
  for (int i = 3; i < argc; ++i) {
    char *value = strchr(argv[i], '=');
    if (!value) return 1;
    *value++ = 0;
    check(dynvox_config_set(&config, argv[i], value), argv[i]);
    if (strcmp(argv[i], "volume.voxel_size_m") == 0) voxel_size_m = strtof(value, NULL);
  }
  DynvoxBudget budget = {.bytes = strtoull(argv[2], NULL, 10), .width = width, .height = height, .voxel_size_m = voxel_size_m};
  size_t bytes = 0, least = 0;
  DynvoxCapacity capacity;
  if (budget.bytes == 0)
    check(dynvox_capacity_of_profile(DYNVOX_PROFILE_TINY, &capacity), "capacity");
  else
    check(dynvox_capacity_for_budget(&budget, &capacity, &least), "capacity");
  check(dynvox_bytes(&capacity, &bytes), "bytes");
  size_t alignment = dynvox_alignment();
  uint8_t *buffer = aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  DynvoxMapper *mapper;
  check(dynvox_create(&capacity, &config, buffer, bytes, &mapper), "create");

  DynvoxReport report;
  Retired retired = {0};
  DynvoxObjectSink objects = {&retired, retire};
  for (uint32_t index = 0; index < frames; ++index) {
    DynvoxFrame frame = {0};
    DynvoxDetection detections[64];
    frame.width = width;
    frame.height = height;
    frame.left = (DynvoxImage){at, width};
    at += width * height;
    frame.right = (DynvoxImage){at, width};
    at += width * height;
    frame.detection_count = take_u32();
    frame.detections = detections;
    for (size_t i = 0; i < frame.detection_count; ++i) {
      DynvoxDetection *seen = &detections[i];
      seen->class_code = *at++;
      seen->score = take_f32();
      seen->left = (int32_t)take_u32();
      seen->top = (int32_t)take_u32();
      seen->width = take_u32();
      seen->height = take_u32();
      seen->mask = at;
      at += (size_t)seen->width * seen->height;
    }
    check(dynvox_step_with(mapper, &frame, NULL, &objects, &report), "step");
    printf("%u %016llx\n", (unsigned)report.frame, (unsigned long long)report.digest);
  }

  float *depth_m = malloc(width * height * sizeof *depth_m);
  DynvoxPicture picture = {0};
  picture.capacity = width * height;
  picture.depth_m = depth_m;
  DynvoxPose pose;
  check(dynvox_pose(mapper, &pose), "pose");
  check(dynvox_raycast(mapper, &pose, &picture), "raycast");
  size_t seen = 0;
  for (size_t i = 0; i < width * height; ++i) seen += depth_m[i] > 0;
  uint64_t triangles = 0, reported = 0;
  check(dynvox_triangles(mapper, count, &triangles, &reported), "triangles");
  uint32_t left = 0, stored = 0, lost = 0;
  DynvoxStore store = {&left, store_block, NULL};
  check(dynvox_finish_with(mapper, &objects), "finish");
  check(dynvox_stream_out(mapper, &store, &stored, &lost), "stream out");
  check(dynvox_destroy(mapper), "destroy");
  fprintf(stderr, "%zu of %zu pixels show the map, %llu triangles, %u blocks left; %u objects of %llu triangles\n", seen, width * height, (unsigned long long)triangles,
          (unsigned)left, (unsigned)retired.objects, (unsigned long long)retired.triangles);
  free(depth_m);
  free(buffer);
  free(clip);
  return triangles == reported && left == stored && lost == 0 && seen > 0 ? 0 : 1;
}
