/* Maps one stereo pair of 320 x 96 px within 8 MiB: the interface in twenty lines. */
#include "dynvox.h"

#include <stdio.h>

static _Alignas(64) uint8_t buffer[8u << 20];
static uint8_t left[96][320], right[96][320];

static void count(void *context, const DynvoxTriangle *triangle) {
  if (triangle->vertices[0].position_m[2] > 0) ++*(unsigned *)context;
}

int main(void) {
  for (int v = 0; v < 96; ++v)
    for (int u = 0; u < 320; ++u) left[v][u] = right[v][(u + 310) % 320] = (uint8_t)((u / 3 * 2654435761u ^ v / 3 * 40503777u) >> 7);
  DynvoxRig rig = {200, 159.5, 47.5, 0.5};
  DynvoxConfig config;
  DynvoxBudget budget = {.bytes = sizeof buffer, .width = 320, .height = 96, .voxel_size_m = 0.1f};
  DynvoxCapacity capacity;
  DynvoxMapper *mapper;
  DynvoxReport report;
  uint64_t time_ns = 0;
  unsigned triangles = 0;
  if (dynvox_config_default(&rig, &config) || dynvox_config_set(&config, "volume.voxel_size_m", "0.1") ||
      dynvox_capacity_for_budget(&budget, &capacity, NULL) ||
      dynvox_create(&capacity, &config, buffer, sizeof buffer, &mapper))
    return 1;
  DynvoxFrame frame = {.width = 320, .height = 96, .left = {left[0], 320}, .right = {right[0], 320}, .time_ns = &time_ns};
  for (int i = 0; i < 3; ++i, time_ns += 33333333)
    if (dynvox_step(mapper, &frame, NULL, &report)) return 1;
  dynvox_triangles(mapper, count, &triangles, NULL);
  printf("frame %u: %u blocks, %u triangles\n", (unsigned)report.frame, (unsigned)report.blocks, triangles);
  return triangles == 0 || dynvox_destroy(mapper) != DYNVOX_STATUS_OK;
}
