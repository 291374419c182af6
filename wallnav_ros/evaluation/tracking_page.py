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

{seeds} episodes with a driving robot, mapped walls, 2 cm range noise, 2 % odometry drift, scans
of 360 beams at 10 Hz. Agents on which at least five beams end are visible; a track is theirs
within {match} m, one to one. Velocities count {settled} s after birth. A label is right where it
says what the agent is: walking ones are human even while they stand. *Decidable* leaves out the
walkers who have come less than {step} m since their track's birth, whom nothing tells from things
that stand.

| scene | figure | measured | target | |
|---|---|---|---|---|
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
- *Without odometry* (negative_2, following_outdoor_1) the robot's motion comes from matching
  scans. Outdoors there is nothing to match; the person is known by legs that swing against each
  other, and stands still in the first 24 s. The tracks' places are not off to one side: the mean
  offset from the annotations is 2.6 cm along the line of sight and 0.9 cm across, and without it
  the error would be 0.003 m less. Held against the wheels of `leg_tracker_bench_moving_1`, scans
  alone lose the way in a corridor full of people.
- *False people.* From a moving robot, edges of furniture that come into view, surfaces that return
  only some beams and things hit on a slant are at times taken for movers. Outdoors, passing specks
  are. The scans of `olin_mac_1st_floor_take_2` come with the beams in reverse, which the tracker
  finds out by itself; until it has, things seen in turns are bent.
- *Simulated labels and velocities.* Walkers who are blocked or slow before they have covered
  their own width are still obstacles, with no velocity. A third of the squared errors in velocity
  is in the worst one per cent: agents of the simulator change their velocity at once. With a
  motion noise of 0.3 instead of 0.4, whoever turns is lost: the person of `body_811beam` is found
  in a quarter fewer scans. So a second filter with a noise of 0.25 tells the velocity, and nothing
  else: 0.118 instead of 0.126 m/s here, 0.133 instead of 0.138 in eight other episodes, which are
  harder. Noise that swells with the surprise of a measurement was no better.
- *Lost identities.* Remembering people for four seconds behind what hides them, or giving whoever
  turns up beside one who is looked for that one's identity, changed no count of people, and
  brought more false ones back.
- *Crowds.* In `tamu_people_2023/example9` people overlap in pairs, and two get a second identity.

## Pictures

{pictures}
"""
