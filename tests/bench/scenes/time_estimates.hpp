// Forecast against measured times of settings over the generated scenes (scenes/scene_set).
#pragma once

namespace windsplat::bench {

// Prints a line for each scene, what is shown, size and setting: measured time, forecast before any
// measurement, both in ms. Measured is the processor time of two threads, halved, the smaller of
// two runs after one that fills caches. `side`: samples along each side of the two large cubes.
void list_times(int side);

// The same for the family of small datasets that estimates of errors are fitted to, and strangers.
void list_family_times(int scenes, int viewpoints);

}  // namespace windsplat::bench
