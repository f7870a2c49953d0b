#!/usr/bin/env bash
# The jobs of `dynvox fleet plan recordings.toml --out jobs` as a Slurm array, then the merge:
#
#   array=$(sbatch --parsable --array=0-15 --mem=1G host/examples/fleet/slurm.sh jobs)
#   sbatch --dependency=afterok:$array --wrap "dynvox fleet align jobs && dynvox fleet resample jobs && dynvox fleet merge jobs --out map"
#
# Give --mem what `dynvox fleet status jobs` lists, and an array of at most as many tasks as there are jobs. A task that was killed is
# repeated with the same command: what is done is left alone.
exec dynvox fleet run "$1"
