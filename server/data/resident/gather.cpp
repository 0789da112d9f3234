// Volumes of a grid of boxes: each is copied from a resident one, read, or made of what is read.
#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "server/data/resident/dataset_state.hpp"

namespace windsplat::data {

namespace {

// Copies boxes into a volume, and knows which are there.
class Gathering {
 public:
  Gathering(const BoxGrid& grid, int components) : grid_(grid), boxes_(grid.boxes()) {
    volume_.dims = dims_of(grid);
    volume_.components = components;
    volume_.values = Samples(volume_.samples() * static_cast<std::size_t>(components));
    std::fill_n(volume_.values.data(), volume_.values.size(),
                std::numeric_limits<float>::quiet_NaN());
    is_there_.resize(boxes_.size());
  }

  [[nodiscard]] const std::vector<Box>& boxes() const { return boxes_; }
  [[nodiscard]] bool is_there(std::size_t n) const { return is_there_[n]; }

  // From the samples of a part that holds the box.
  void copy(std::size_t n, const Volume& volume, const HeldPart& part) {
    const Box& box = boxes_[n];
    std::array<int, 3> at = box.first;
    for (at[2] = box.first[2]; at[2] < box.first[2] + box.count[2]; ++at[2]) {
      for (at[1] = box.first[1]; at[1] < box.first[1] + box.count[1]; ++at[1]) {
        const std::size_t to = grid_.number_of(at);
        const std::size_t from = number_in(part, at);
        for (int c = 0; c < volume.components; ++c) {
          std::copy_n(volume.component(c) + from, box.count[0],
                      volume_.values.data() + static_cast<std::size_t>(c) * volume_.samples() + to);
        }
      }
    }
    is_there_[n] = true;
  }

  Volume take() { return std::move(volume_); }

 private:
  static std::size_t number_in(const HeldPart& part, const std::array<int, 3>& sample) {
    if (part.grid) return part.grid->number_of(sample);
    std::size_t number = 0;
    for (std::size_t a = 3; a-- > 0;) {
      number = number * static_cast<std::size_t>(part.box.count[a]) +
               static_cast<std::size_t>(sample[a] - part.box.first[a]);
    }
    return number;
  }

  const BoxGrid& grid_;
  const std::vector<Box> boxes_;
  Volume volume_;
  std::vector<bool> is_there_;
};

bool holds(const HeldPart& part, const Box& box, const std::array<int, 3>& size) {
  for (std::size_t a = 0; a < 3; ++a) {
    const int end = part.box.first[a] + part.box.count[a];
    if (box.first[a] < part.box.first[a] || box.first[a] + box.count[a] > end) return false;
  }
  if (!part.grid) return true;
  return part.grid->size == size && part.grid->places[part.grid->index_of(box.first)] > 0;
}

}  // namespace

Result<Volume> Dataset::gather(std::size_t field, std::size_t step, const Derivation& how) {
  const GatheredBoxes& gathered = *how.gathered;
  const FieldInfo& about = state_->info.fields[field];
  const Derivation first = gathered.part(0);
  const StoredAs as = first.stored ? first.stored->as : first.from->stored->as;
  Gathering out(gathered.grid, components_of(about, as));
  const auto& boxes = out.boxes();
  // Each is referenced only while it is copied, so that its room is there for what is read.
  for (const HeldPart& there : resident_parts(about.name, step, first, boxes.front())) {
    std::vector<std::size_t> found;
    for (std::size_t n = 0; n < boxes.size(); ++n) {
      if (!out.is_there(n) && holds(there, boxes[n], gathered.grid.size)) found.push_back(n);
    }
    if (found.empty()) continue;
    Derivation its = first;
    its.variant.resize(its.variant.size() - data::key_of(boxes.front()).size());
    its.variant += there.grid ? data::key_of(*there.grid) : data::key_of(there.box);
    const Resident resident = state_->budget->find_now(*key_of(about.name, step, its));
    if (!resident) continue;
    const auto volume = std::static_pointer_cast<const Volume>(resident);
    for (const std::size_t n : found) {
      out.copy(n, *volume, there);
      state_->budget->bricks().had(bricks_in(state_->info, field, gathered.part(n)));
    }
  }
  // Of a whole box, and of what it is made of.
  const auto one = reserve((first.bytes + (first.from ? first.from->bytes : 0)) /
                           boxes.front().samples() * samples_of_box(gathered.grid));
  if (!one) return one.error();
  for (std::size_t n = 0; n < boxes.size(); ++n) {
    if (out.is_there(n)) continue;
    if (cancellation().cancelled()) return make_error(ErrorKind::cancelled, "request cancelled");
    const Derivation part = gathered.part(n);
    const auto read =
        state_->read(field, step, urgency(), part.stored ? &*part.stored : &*part.from->stored);
    if (!read) return read.error();
    const auto volume = std::static_pointer_cast<const Volume>(*read);
    out.copy(n, part.stored ? *volume : part.make(*volume), {boxes[n], nullptr});
  }
  Volume volume = out.take();
  if (!measure_part(state_->info, field, step, as, volume)) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(about.name) + ": boxes hold values that are not finite");
  }
  return volume;
}

}  // namespace windsplat::data
