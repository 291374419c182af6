# Copyright 2026 The wallnav_ros authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.
"""
The text of docs/tracking.md around its measured figures.

Filled in by `tracking_report.page`.
"""

PAGE = """# How well the tracker does

Written by `python -m wallnav_ros.commands.score_tracking DATA_DIR`; every figure is measured,
none is edited. How the tracker works is told in [perception.md](perception.md).

## Recordings

All recordings are tracked with one set of parameters, those of `params/wallnav.yaml`, each scan
as it comes. *Humans* counts tracks labelled human. Annotated positions count as found within
{gate} m of such a track, and belong to the last scan before they were stamped. A track *strays*
while it is over {stray} m from the end of every beam.

| recording | scans | different humans | humans per scan | longest stray | asked of it |
|---|---|---|---|---|---|
{recordings}

## Simulator

Episodes with a driving robot, 15 agents, mapped walls, 2 cm range noise, 2 % odometry drift,
scans of 360 beams at 10 Hz. The first eight are those something is asked of; the tracker was not
tuned to the others. Agents on which at least five beams end are visible; a track is theirs within
{match} m, one to one. Velocities count {settled} s after birth. A label is right where it says
what the agent is: walking ones are human even while they stand. *Decidable* leaves out the walkers
who have come less than {step} m since their track's birth, whom nothing tells from things that
stand.

| scene | seeds | figure | measured | target | |
|---|---|---|---|---|---|
{simulations}

## What is missed, and why

- *People who stand from the first scan on* are not told from furniture. Three in five positions
  annotated in `leg_tracker_bench_moving_1` are of people who stand talking in a corridor while the
  robot drives by; mostly one leg of them is seen, as three to five beams. Shape does not tell: a
  boosted classifier of sixteen shape features of a cluster and its neighbourhood, trained, to have
  an upper bound, on these very recordings with one person left out at a time, found 3 to 22 % of
  their clusters at 0.05 false ones a scan in `leg_tracker_training/negative_2` (21 to 70 % at
  0.5).
  Two round, free legs with no third beside them, each of eight beams or more, are 16 of the 213
  clusters of people there, and 156 in `negative_2`, where nobody is. So the label is left to
  motion.
- *The same recording's walkers* are seen at 7.5 Hz, five metres off, on one leg at a time, in
  three to five beams and not in every scan: the foot on the ground stands for a scan or two, then
  shows up a step further on. So does a track that takes one thing that stands for another, as
  driving robots see them: three quarters of the longest leap are not believed. Four in five of
  these feet come down where nothing was, as earlier views say. Believing what one view says of
  that, a third of the annotated positions are found, and 0.26 to 0.36 people a scan in
  `negative_2`. Asking three of sixteen views, and linking feet by steps, finds 0.24 of them, with
  0.75 instead of 0.42 people a scan in `olin_mac_1st_floor_take_2` and two more identities in
  `tamu_people_2023/example9`: not worth it to a robot that would rather not see people in
  furniture, so it was left out.
- *With odometry*, earlier views could be trusted more. Naming whatever lies all on free space,
  after 0.1 m of way or none, finds 0.092 of `leg_tracker_bench_moving_1` with 1.06 to 1.15
  instead of 0.71 people a scan, and twice as many in `carmen_logs`: what is missing there are
  tracks, not evidence.
- *Without odometry* (negative_2, following_outdoor_1) the robot's motion comes from matching
  scans. Outdoors there is nothing to match, and it snows; the person is known by legs that swing
  against each other. All misses but one are in the first five seconds, in which the person
  stands. Flakes took legs, and tracks of people flakes, until tracks that are known chose first,
  specks kept to specks, and a pair might cost no more than a gate and two mismatches: recall was
  0.945, with 2 switches and 0.082 m. Held against the wheels of `leg_tracker_bench_moving_1`,
  scans alone lose the way in a corridor full of people.
- *False people.* From a moving robot, edges of furniture that come into view, surfaces that
  return only some beams and things hit on a slant are at times taken for movers. Outdoors,
  passing specks are. The scans of `olin_mac_1st_floor_take_2` come with the beams in reverse,
  which the tracker finds out by itself; until it has, things seen in turns are bent.
- *False people in a map.* Replayed in the map of its floor, the same recording has 0.78 people a
  scan, six in all; it had 1.28 and fourteen while every way of 0.25 m counted where a map was
  given. A map lacks a tenth of what is seen there, and pieces of that look as if they moved. So
  a way counts without more ado only for what is round, and for what nobody can tell yet where
  most of the rest is round.
- *Simulated labels.* Most of the wrong ones are in the first second of a track: a disc is
  believed to walk once its centre has come 0.1 m along a line that is sure to four standard
  deviations, which takes a slow walker a while. Others are walkers who came to stand while
  something hid them, or stand still from the first scan on. Believing 0.07 m gains 0.002 in some
  episodes, and in others names things that stand. Believing a way of 0.25 m also where something
  stood before gains 0.005 in some and loses 0.005 in others.
- *Simulated velocities.* Clusters lose their grazing beams, or a side behind something nearer,
  and until circles were fitted to them their centres were up to 0.1 m off: RMSE was 0.118 m/s,
  MOTP 0.075 m. Two fifths of the squared errors are in the worst one per cent: agents of the
  simulator change their velocity at once, and those who pass each other closely are at times
  mixed up. The second, steadier filter is worth 0.003 m/s now; several motion models side by
  side (IMM) were worse than one, at 0.21 m/s and more instead of 0.17 for the walkers.
- *Lost identities.* Remembering people for four seconds behind what hides them, or giving
  whoever turns up beside one who is looked for that one's identity, changed no count of people,
  and brought more false ones back. Remembering only those who stand, for 15 s, changed the
  labels of one of forty simulated episodes.
- *Crowds.* In `tamu_people_2023/example9` people overlap in pairs, and some get a second identity.

## Pictures

{pictures}
"""
