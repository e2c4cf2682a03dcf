#!/usr/bin/env python3
"""Simulates a farm of many machines from the shard times that a farm on few has measured.

  clamor farm status hall.clamor --json | tools/farm/simulate.py --merge-s 12.5
  tools/farm/simulate.py --self-test

Model: each machine has one core for the farm and takes the next shard of a list when it has ended
one. A shard takes as long as reading and preparing the level, and as its share of the tracing in core
seconds; how much the shares differ is drawn from those that were measured. The bytes of a shard go to the shared
disk, which serves all machines at --disk MB/s. The merge begins when the last shard is there and
runs on one machine. With more than 256 shards, groups are joined before that on all machines, each
reading and writing its part of all bytes once. No machine fails: one that does costs its shard.
"""
import argparse
import heapq
import json
import math
import random
import sys


def makespan(times_s, machines, busy_disk_s):
    """Seconds until all shards are traced and written."""
    free_at = [0.0] * machines
    heapq.heapify(free_at)
    disk_free_at = 0.0
    end = 0.0
    for trace_s in times_s:
        traced = heapq.heappop(free_at) + trace_s
        # Journals are written while tracing; what the disk cannot keep up with comes after it.
        disk_free_at = max(disk_free_at + busy_disk_s, traced)
        heapq.heappush(free_at, disk_free_at if busy_disk_s > 0 else traced)
        end = max(end, disk_free_at)
    return end


def simulate(farm, machines, per_machine, disk_mb_s, merge_s, seed):
    """Seconds of tracing, joining and merging, the efficiency of tracing, and of all of it."""
    shards = farm["shards"]
    preparing_s = farm["preparing_s"]
    tracing_s = sum(max(0.0, shard["core_seconds"]) for shard in shards)
    mean = tracing_s / len(shards)
    spread = [shard["core_seconds"] / mean if mean > 0 else 1.0 for shard in shards]
    draws = random.Random(seed)
    count = machines * per_machine
    times = [preparing_s + tracing_s / count * draws.choice(spread) for _ in range(count)]
    disk_s = farm["bytes"] / 1e6 / disk_mb_s
    trace_s = makespan(times, machines, disk_s / count)
    groups = math.ceil(math.sqrt(count)) if count > 256 else 0
    join_s = 2 * disk_s if groups else 0.0
    # One process with one core would prepare once, trace everything and merge.
    one_s = preparing_s + tracing_s + merge_s
    all_s = trace_s + join_s + merge_s
    ideal_s = (preparing_s + tracing_s) / machines
    return count, trace_s, join_s, all_s, ideal_s / trace_s, one_s / (machines * all_s)


def self_test():
    farm = {"bytes": 0, "preparing_s": 0.0, "shards": [{"core_seconds": 10.0}] * 4}
    count, trace_s, _, all_s, efficiency, _ = simulate(farm, 2, 2, 100, 0, 1)
    assert (count, trace_s, all_s, efficiency) == (4, 20, 20, 1), "equal shards divide evenly"
    assert makespan([3, 1, 1, 1], 2, 0) == 3, "the next free machine takes the next shard"
    assert makespan([1] * 8, 8, 1) >= 8, "a slow disk is the limit of any number of machines"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--machines", default="1,2,16,100,300,1000")
    parser.add_argument("--shards-per-machine", type=int, default=4)
    parser.add_argument("--disk", type=float, default=100, help="MB/s of the shared disk [100]")
    parser.add_argument("--merge-s", type=float, default=0, help="seconds of the merge")
    parser.add_argument("--scale", type=float, default=1, help="times as many photons [1]")
    parser.add_argument("--scale-bytes", type=float, default=1, help="times as many sources [1]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    farm = json.load(sys.stdin)
    farm["shards"] = [shard for shard in farm["shards"] if shard["state"] == "done"]
    if not farm["shards"]:
        sys.exit("simulate.py: no shard of this farm is done")
    for shard in farm["shards"]:
        # A shard of a small bake may have had no photon to trace.
        shard["core_seconds"] = shard.get("core_seconds", 0) * arguments.scale
    farm["bytes"] *= arguments.scale_bytes
    print("| machines | shards | tracing | joining | with merge | efficiency of tracing | of all |")
    print("|---|---|---|---|---|---|---|")
    for machines in map(int, arguments.machines.split(",")):
        count, trace_s, join_s, all_s, tracing, everything = simulate(
            farm, machines, arguments.shards_per_machine, arguments.disk, arguments.merge_s,
            arguments.seed)
        print(f"| {machines} | {count} | {trace_s:.1f} s | {join_s:.1f} s | {all_s:.1f} s | "
              f"{tracing:.2f} | {everything:.2f} |")


if __name__ == "__main__":
    main()
