#!/bin/sh
# The table of map size, accuracy and completeness against the prune weight: `host/tools/prune_weights.sh [dynvox run arguments]`.
# Needs jq. DYNVOX names the binary.
set -eu
dynvox=${DYNVOX:-target/release/dynvox}
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
echo "| prune weight | blocks in the end | memory, MiB | against weight 0 | voxels reset | blocks freed | triangles | accuracy | completeness | median error, cm |"
echo "|---|---|---|---|---|---|---|---|---|---|"
for weight in 0 1 2 3 5; do
    "$dynvox" run "$@" --set volume.prune_rule=weight --set volume.prune_weight=$weight --out "$out/$weight" --json > "$out/$weight.json"
    # A block with colour takes 3,072 bytes.
    jq -r --arg weight $weight --slurpfile first "$out/0.json" '
        def round3: . * 1000 | round / 1000;
        ($first[0].map.blocks) as $all
        | "| \($weight) | \(.map.blocks) | \(.map.blocks * 3072 / 1048576 | round) | \((.map.blocks - $all) / $all * 100 | round) % "
        + "| \(.prune.voxels_reset) | \(.prune.blocks_freed) | \(.map.triangles) "
        + (.exact.static // {} | "| \(.accuracy // null | if . then round3 else "-" end) | \(.completeness // null | if . then round3 else "-" end) "
        + "| \(.median_error_m // null | if . then . * 100 | round3 else "-" end) |")' "$out/$weight.json"
done
