// Reads in blocks of some MiB, in whole chunks if the file has chunks.
#include "server/data/cf/read_blocks.hpp"

#include <algorithm>
#include <limits>
#include <type_traits>
#include <vector>

#include "server/data/cf/packing.hpp"

namespace windsplat::data::cf {

namespace {

// Doubles read at a time: 32 MiB where whole chunks are needed, otherwise 2 MiB.
constexpr std::size_t chunked_values = std::size_t{4} << 20;
constexpr std::size_t plain_values = std::size_t{1} << 18;
// Mapping of one dimension of a variable to the volume.
struct Way {
  std::size_t first = 0;      // index in the file where reading starts
  std::size_t length = 1;     // how many indices are read
  std::ptrdiff_t stride = 0;  // floats between neighbours in the volume, negative if the axis is
                              // reversed
};

// Calls row(offset of its first value in the volume, its values) for all rows of a block (counts,
// last fastest).
template <class T, class Row>
void for_rows(const T* block, const std::vector<std::size_t>& count, const std::vector<Way>& ways,
              const Row& row) {
  const std::size_t rank = count.size();
  std::vector<std::size_t> index(rank, 0);
  for (;;) {
    std::ptrdiff_t offset = 0;
    for (std::size_t d = 0; d + 1 < rank; ++d) {
      offset += static_cast<std::ptrdiff_t>(index[d]) * ways[d].stride;
    }
    row(offset, block);
    block += count.back();
    std::size_t d = rank - 1;
    for (; d > 0; --d) {  // counts through all dimensions but the last
      if (++index[d - 1] < count[d - 1]) {
        break;
      }
      index[d - 1] = 0;
    }
    if (d == 0) {
      return;
    }
  }
}

// Unpacks a block into the volume, starting at `out`.
void scatter(const Packing& packing, const double* block, const std::vector<std::size_t>& count,
             const std::vector<Way>& ways, float* out) {
  const std::ptrdiff_t stride = ways.back().stride;
  for_rows(block, count, ways, [&](std::ptrdiff_t offset, const double* row) {
    for (std::size_t i = 0; i < count.back(); ++i) {
      out[offset + static_cast<std::ptrdiff_t>(i) * stride] = unpack(packing, row[i]);
    }
  });
}

void scatter(const FloatMask& mask, float* block, const std::vector<std::size_t>& count,
             const std::vector<Way>& ways, float* out) {
  const std::ptrdiff_t stride = ways.back().stride;
  std::size_t values = 1;
  for (const std::size_t n : count) values *= n;
  apply(mask, block, values);
  for_rows(block, count, ways, [&](std::ptrdiff_t offset, const float* row) {
    float* to = out + offset;
    if (stride == 1) {
      std::copy_n(row, count.back(), to);
      return;
    }
    for (std::size_t i = 0; i < count.back(); ++i) {
      to[static_cast<std::ptrdiff_t>(i) * stride] = row[i];
    }
  });
}

// Whether a block is contiguous in the volume, in the order of the file.
bool in_one_piece(const std::vector<std::size_t>& count, const std::vector<Way>& ways) {
  std::ptrdiff_t values = 1;
  for (std::size_t d = ways.size(); d-- > 0;) {
    if (count[d] > 1 && ways[d].stride != values) return false;
    values *= static_cast<std::ptrdiff_t>(count[d]);
  }
  return true;
}

// Extent of a block along each dimension: whole inner dimensions, part of one, 1 along outer ones.
std::vector<std::size_t> block_counts(const std::vector<Way>& ways,
                                      const std::vector<std::size_t>& chunk) {
  const bool chunked = std::any_of(chunk.begin(), chunk.end(), [](auto n) { return n > 1; });
  const std::size_t block_values = chunked ? chunked_values : plain_values;
  std::vector<std::size_t> count(ways.size(), 1);
  std::size_t values = 1;
  for (std::size_t d = ways.size(); d-- > 0;) {
    const std::size_t fit = std::max<std::size_t>(1, block_values / values);
    count[d] = std::min(ways[d].length, fit);
    if (count[d] < ways[d].length) {
      // Whole chunks, so that none is decompressed twice.
      if (count[d] > chunk[d]) {
        count[d] -= count[d] % chunk[d];
      }
      break;
    }
    values *= count[d];
  }
  return count;
}

// All samples of those levels.
Box box_of(const Placement& grid, const Levels& levels) {
  return {{0, 0, static_cast<int>(levels.first)},
          {static_cast<int>(grid.length[0]), static_cast<int>(grid.length[1]),
           static_cast<int>(levels.count)}};
}

// Mapping of each dimension of a variable; sets `origin` to the offset of the first value.
std::vector<Way> ways_of(const ArrayFile& file, const Placement& grid, int variable,
                         std::size_t step, const Box& box, std::ptrdiff_t& origin) {
  const std::ptrdiff_t row = box.count[0];
  const std::array<std::ptrdiff_t, 3> strides{1, row, row * box.count[1]};
  std::vector<Way> ways;
  origin = 0;
  for (const int id : file.contents().variables.at(static_cast<std::size_t>(variable)).dims) {
    Way way;
    const auto* at = std::find(grid.space.begin(), grid.space.end(), id);
    if (at != grid.space.end()) {
      const auto axis = static_cast<std::size_t>(at - grid.space.begin());
      const bool turned = grid.turned.at(axis);
      const auto first = static_cast<std::size_t>(box.first.at(axis));
      way.length = static_cast<std::size_t>(box.count.at(axis));
      way.first = turned ? grid.length.at(axis) - first - way.length : first;
      way.stride = strides.at(axis);
      if (turned) {
        origin += static_cast<std::ptrdiff_t>(way.length - 1) * way.stride;
        way.stride = -way.stride;
      }
    } else if (id == grid.time) {
      way.first = step;
    }
    ways.push_back(way);
  }
  return ways;
}

// One block of a variable.
struct Walk {
  std::vector<std::size_t> start;
  std::vector<std::size_t> count;
  std::ptrdiff_t corner = 0;  // offset of its first value in the volume
  std::size_t values = 1;     // number of values
};

Walk block_at(const std::vector<Way>& ways, const std::vector<std::size_t>& block,
              const std::vector<std::size_t>& chunk, const std::vector<std::size_t>& index,
              std::ptrdiff_t origin) {
  Walk walk;
  walk.corner = origin;
  for (std::size_t d = 0; d < ways.size(); ++d) {
    const std::size_t start = ways[d].first + index[d];
    std::size_t count = std::min(block[d], ways[d].length - index[d]);
    // A block that ends within the range ends with a chunk, so that none is decoded twice.
    const std::size_t beyond = (start + count) % chunk[d];
    if (count < ways[d].length - index[d] && beyond < count) count -= beyond;
    walk.start.push_back(start);
    walk.count.push_back(count);
    walk.corner += static_cast<std::ptrdiff_t>(index[d]) * ways[d].stride;
    walk.values *= walk.count[d];
  }
  return walk;
}

// Advances from a block of those counts to the next; false after the last.
bool advance(const std::vector<Way>& ways, const std::vector<std::size_t>& count,
             std::vector<std::size_t>& index) {
  for (std::size_t d = ways.size(); d > 0; --d) {
    index[d - 1] += count[d - 1];
    if (index[d - 1] < ways[d - 1].length) return true;
    index[d - 1] = 0;
  }
  return false;
}

// Reads all blocks as type T and converts stored numbers to values by `rule`.
template <class T, class Rule>
Result<void> read_blocks(const ArrayFile& file, int variable, const std::vector<Way>& ways,
                         std::ptrdiff_t origin, const Rule& rule, float* out,
                         const Progress& tell) {
  const std::vector<std::size_t> chunk = file.chunk(variable);
  const std::vector<std::size_t> block = block_counts(ways, chunk);
  std::size_t all = 1;
  for (const Way& way : ways) all *= way.length;
  std::vector<T> buffer;
  std::size_t done = 0;
  std::vector<std::size_t> index(ways.size(), 0);  // index in the block, relative to `first`
  bool is_last = false;
  while (!is_last) {
    const Walk walk = block_at(ways, block, chunk, index, origin);
    bool in_place = false;
    if constexpr (std::is_same_v<T, float>) {
      in_place = in_one_piece(walk.count, ways);
      if (in_place) {
        if (auto read = file.read(variable, walk.start, walk.count, out + walk.corner); !read) {
          return read;
        }
        apply(rule, out + walk.corner, walk.values);
      }
    }
    if (!in_place) {
      buffer.resize(std::max(buffer.size(), walk.values));
      if (auto read = file.read(variable, walk.start, walk.count, buffer.data()); !read) {
        return read;
      }
      scatter(rule, buffer.data(), walk.count, ways, out + walk.corner);
    }
    done += walk.values;
    tell(static_cast<double>(done) / static_cast<double>(all));
    is_last = !advance(ways, walk.count, index);
  }
  return {};
}

}  // namespace

std::vector<Levels> level_parts(const ArrayFile& file, const Placement& grid, int variable,
                                std::size_t levels_max) {
  // Decoded bytes of a layer of chunks that every reader keeps between reads, and their number
  // (netcdf::File::keep_chunks()); each part costs some time for each of them.
  constexpr double kept_bytes = 64 << 20;
  constexpr double kept_chunks = 1000;
  if (grid.space[2] < 0) return {{0, 1}};
  const FileVariable& about = file.contents().variables.at(at(variable));
  const auto place = std::find(about.dims.begin(), about.dims.end(), grid.space[2]);
  const auto is_across = [&](int id) { return id == grid.space[0] || id == grid.space[1]; };
  if (!about.layers_apart || place == about.dims.end() ||
      std::any_of(about.dims.begin(), place, is_across)) {
    return {};
  }
  const std::vector<std::size_t> chunk = file.chunk(variable);
  double chunks = 1;
  double chunks_bytes = sizeof(double);  // chunks at the edges are whole too
  for (std::size_t d = 0; d < chunk.size(); ++d) {
    chunks_bytes *= static_cast<double>(chunk[d]);
    if (!is_across(about.dims[d])) continue;
    const std::size_t length = file.contents().dimensions.at(at(about.dims[d])).length;
    const std::size_t along = (length + chunk[d] - 1) / chunk[d];
    chunks *= static_cast<double>(along);
    chunks_bytes *= static_cast<double>(along);
  }
  const std::size_t deep = chunk[static_cast<std::size_t>(place - about.dims.begin())];
  const bool in_chunks = deep <= levels_max;
  if (!in_chunks && (chunks > kept_chunks || chunks_bytes > kept_bytes)) return {};
  const std::size_t all = grid.length[2];
  const std::size_t most = in_chunks ? levels_max - levels_max % deep : levels_max;
  std::vector<Levels> out;
  for (std::size_t from = 0; from < all;) {
    std::size_t count = std::min(most, all - from);
    if (!in_chunks) count = std::min(count, deep - from % deep);
    out.push_back({grid.turned[2] ? all - from - count : from, count});
    from += count;
  }
  return out;
}

void mask_columns(const std::vector<bool>& columns, const Box& box, std::size_t width,
                  float* values) {
  if (columns.empty()) return;
  const auto [columns_x, rows, layers] = box.count;
  const auto row = static_cast<std::size_t>(columns_x);
  for (int j = 0; j < rows; ++j) {
    const std::size_t first =
        static_cast<std::size_t>(box.first[1] + j) * width + static_cast<std::size_t>(box.first[0]);
    for (std::size_t i = 0; i < row; ++i) {
      if (!columns[first + i]) continue;
      for (int k = 0; k < layers; ++k) {
        const auto at = static_cast<std::size_t>(k) * static_cast<std::size_t>(rows) +
                        static_cast<std::size_t>(j);
        values[at * row + i] = std::numeric_limits<float>::quiet_NaN();
      }
    }
  }
}

BoxChunk box_chunk(const ArrayFile& file, const Placement& grid,
                   const std::vector<int>& variables) {
  BoxChunk out;
  for (const int variable : variables) {
    const FileVariable& about = file.contents().variables.at(at(variable));
    const std::vector<std::size_t> chunk = file.chunk(variable);
    for (std::size_t a = 0; a < 3; ++a) {
      out.length.at(a) = std::max(out.length.at(a), 1);
      if (grid.space.at(a) < 0) continue;
      const auto place = std::find(about.dims.begin(), about.dims.end(), grid.space.at(a));
      if (place == about.dims.end() || !about.layers_apart) return {};
      const std::size_t length =
          std::min(chunk[static_cast<std::size_t>(place - about.dims.begin())], grid.length.at(a));
      out.length.at(a) = std::max(out.length.at(a), static_cast<int>(length));
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    const auto all = static_cast<int>(grid.length.at(a));
    if (grid.turned.at(a)) out.first.at(a) = all % out.length.at(a);
  }
  return out;
}

void multiply(double factor, std::size_t count, float* values) {
  if (factor == 1) return;
  for (std::size_t n = 0; n < count; ++n) {
    values[n] = static_cast<float>(static_cast<double>(values[n]) * factor);
  }
}

double decoded_step_bytes(const ArrayFile& file, const Placement& grid, int variable,
                          const Levels& levels) {
  std::ptrdiff_t origin = 0;
  std::vector<std::size_t> start;
  std::vector<std::size_t> count;
  double volume = sizeof(float);
  for (const Way& way : ways_of(file, grid, variable, 0, box_of(grid, levels), origin)) {
    start.push_back(way.first);
    count.push_back(way.length);
    volume *= static_cast<double>(way.length);
  }
  return std::max(decoded_bytes(file, variable, start, count), volume);
}

void expect_box(const ArrayFile& file, const Placement& grid, const std::vector<int>& variables,
                std::size_t step, const Box& box) {
  std::ptrdiff_t origin = 0;
  std::vector<Block> blocks;
  for (const int variable : variables) {
    Block& block = blocks.emplace_back(Block{variable, {}, {}});
    for (const Way& way : ways_of(file, grid, variable, step, box, origin)) {
      block.start.push_back(way.first);
      block.count.push_back(way.length);
    }
  }
  file.expect(blocks);
}

Result<void> read_levels(const ArrayFile& file, const Placement& grid, int variable,
                         std::size_t step, const Levels& levels, float* out, const Progress& tell) {
  return read_box(file, grid, variable, step, box_of(grid, levels), out, tell);
}

Result<void> read_box(const ArrayFile& file, const Placement& grid, int variable, std::size_t step,
                      const Box& box, float* out, const Progress& tell) {
  std::ptrdiff_t origin = 0;
  const std::vector<Way> ways = ways_of(file, grid, variable, step, box, origin);
  const Packing packing = packing_of(file, variable);
  const auto mask = float_mask(packing);
  const auto& type = file.contents().variables.at(static_cast<std::size_t>(variable)).type;
  return type == "float32" && mask
             ? read_blocks<float>(file, variable, ways, origin, *mask, out, tell)
             : read_blocks<double>(file, variable, ways, origin, packing, out, tell);
}

void forget_step(const ArrayFile& file, const Placement& grid, int variable) {
  const auto& dims = file.contents().variables.at(at(variable)).dims;
  const auto time = std::find(dims.begin(), dims.end(), grid.time);
  const auto place = static_cast<std::size_t>(time - dims.begin());
  if (time == dims.end() || file.chunk(variable)[place] == 1) file.forget_chunks(variable);
}

Result<void> read_variable(const ArrayFile& file, const Placement& grid, int variable,
                           std::size_t step, const Levels& levels, float* out,
                           const Progress& tell) {
  auto done = read_levels(file, grid, variable, step, levels, out, tell);
  if (done && levels.first + levels.count >= grid.length[2]) forget_step(file, grid, variable);
  return done;
}

}  // namespace windsplat::data::cf
