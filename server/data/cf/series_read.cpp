// Reads blocks of a series from the members that have the steps.
#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/packing.hpp"
#include "server/data/cf/series.hpp"

namespace windsplat::data::cf {

namespace {

// Scatters a block of one step into the array of all steps.
template <class T>
void interleave(const std::vector<std::size_t>& count, std::size_t axis, std::size_t step,
                const std::vector<T>& block, T* out) {
  std::size_t inner = 1;
  for (std::size_t d = axis + 1; d < count.size(); ++d) inner *= count[d];
  for (std::size_t outer = 0; outer * inner < block.size(); ++outer) {
    std::copy_n(block.data() + outer * inner, inner, out + (outer * count[axis] + step) * inner);
  }
}

}  // namespace

Numbers SeriesFile::numbers(int variable, const char* attribute) const {
  const Variable& way = variables_.at(at(variable));
  return way.as_values ? Numbers() : first_->numbers(way.in_first, attribute);
}

std::string SeriesFile::text_of(int variable, const char* attribute) const {
  return first_->text_of(variables_.at(at(variable)).in_first, attribute);
}

std::vector<std::size_t> SeriesFile::chunk(int variable) const {
  const Variable& way = variables_.at(at(variable));
  std::vector<std::size_t> lengths = first_->chunk(way.in_first);
  if (time_ < 0 && way.time_axis == 0) lengths.insert(lengths.begin(), 1);
  return lengths;
}

std::size_t SeriesFile::chunk_cost_bytes(int variable) const {
  const int in_first = variables_.at(at(variable)).in_first;
  return in_first < 0 ? 0 : first_->chunk_cost_bytes(in_first);
}

// Examines the first member only, to avoid opening the others.
Unwritten SeriesFile::unwritten(int variable, std::size_t most) const {
  const int in_first = variables_.at(at(variable)).in_first;
  if (in_first < 0) return {};
  Unwritten out = first_->unwritten(in_first, most);
  out.is_all = out.is_all && members_.size() == 1;
  return out;
}

void SeriesFile::forget_chunks(int variable) const {
  const Variable& way = variables_.at(at(variable));
  first_->forget_chunks(way.in_first);
  for (const Opened& opened : opened_) {
    const auto& indices = members_[opened.member].variables;
    const int id = indices.empty() ? way.in_first : indices[at(way.in_first)];
    if (id >= 0) opened.file->forget_chunks(id);  // fields without time may be in the first alone
  }
}

Result<const ArrayFile*> SeriesFile::member_file(std::size_t member) const {
  if (member == 0) return first_.get();
  const auto found = std::find_if(opened_.begin(), opened_.end(),
                                  [&](const Opened& opened) { return opened.member == member; });
  if (found != opened_.end()) {
    opened_.splice(opened_.begin(), opened_, found);
    return opened_.front().file.get();
  }
  if (opened_.size() + 2 > open_max) opened_.pop_back();
  auto file = open_member_(members_[member].index);
  if (!file) return file.error();
  if ((*file)->identity() != members_[member].identity) {
    return make_error(ErrorKind::bad_data, in_quotes((*file)->name()) +
                                               " has changed since it was opened; open it again");
  }
  opened_.push_front({member, std::move(*file)});
  return opened_.front().file.get();
}

Result<void> SeriesFile::read_block(const Variable& variable, std::size_t step,
                                    const std::vector<std::size_t>& start,
                                    const std::vector<std::size_t>& count, double* out) const {
  const std::size_t member = variable.time_axis < 0 ? 0 : steps_[step].member;
  const auto file = member_file(member);
  if (!file) return file.error();
  const auto& indices = members_[member].variables;
  const int id = indices.empty() ? variable.in_first : indices[at(variable.in_first)];
  auto done = (*file)->read(id, start, count, out);
  if (done && variable.as_values) {
    const Packing packing = packing_of(**file, id);
    std::size_t values = 1;
    for (const std::size_t n : count) values *= n;
    for (std::size_t i = 0; i < values; ++i) out[i] = unpack_double(packing, out[i]);
  }
  return done;
}

Result<void> SeriesFile::read_block(const Variable& variable, std::size_t step,
                                    const std::vector<std::size_t>& start,
                                    const std::vector<std::size_t>& count, float* out) const {
  if (variable.as_values) {
    std::size_t values = 1;
    for (const std::size_t n : count) values *= n;
    std::vector<double> wide(values);
    auto done = read_block(variable, step, start, count, wide.data());
    std::transform(wide.begin(), wide.end(), out, [](double v) { return static_cast<float>(v); });
    return done;
  }
  const std::size_t member = variable.time_axis < 0 ? 0 : steps_[step].member;
  const auto file = member_file(member);
  if (!file) return file.error();
  const auto& indices = members_[member].variables;
  return (*file)->read(indices.empty() ? variable.in_first : indices[at(variable.in_first)], start,
                       count, out);
}

template <class T>
Result<void> SeriesFile::read_steps(int variable, const std::vector<std::size_t>& start,
                                    const std::vector<std::size_t>& count, T* out) const {
  const Variable& way = variables_.at(at(variable));
  if (way.in_first == time_coordinate_) {
    for (std::size_t i = 0; i < count[0]; ++i) {
      out[i] = static_cast<T>(steps_[start[0] + i].time);
    }
    return {};
  }
  if (way.time_axis < 0) return read_block(way, 0, start, count, out);
  const std::size_t axis = at(way.time_axis);
  std::vector<std::size_t> from = start;
  std::vector<std::size_t> here = count;
  here[axis] = 1;
  if (time_ < 0) {  // members have no time dimension
    from.erase(from.begin());
    here.erase(here.begin());
  }
  std::size_t values = 1;
  for (const std::size_t n : here) values *= n;
  const bool leads = std::all_of(count.begin(), count.begin() + way.time_axis,
                                 [](std::size_t n) { return n == 1; });
  std::vector<T> block(leads ? 0 : values);
  for (std::size_t i = 0; i < count[axis]; ++i) {
    const std::size_t step = start[axis] + i;
    if (time_ >= 0) from[axis] = steps_[step].record;
    T* to = leads ? out + i * values : block.data();
    if (auto done = read_block(way, step, from, here, to); !done) return done;
    if (!leads) interleave(count, axis, i, block, out);
  }
  return {};
}

Result<void> SeriesFile::read(int variable, const std::vector<std::size_t>& start,
                              const std::vector<std::size_t>& count, double* out) const {
  return read_steps(variable, start, count, out);
}

Result<void> SeriesFile::read(int variable, const std::vector<std::size_t>& start,
                              const std::vector<std::size_t>& count, float* out) const {
  return read_steps(variable, start, count, out);
}

}  // namespace windsplat::data::cf
