// Reads what lies on a mesh onto a lattice, layer by layer.
#include "server/data/cf/mesh/meshed_file.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/data/bytes/decode_limits.hpp"
#include "server/data/cf/edges/edges.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/mesh/centers.hpp"
#include "server/data/cf/mesh/mesh_contents.hpp"
#include "server/data/cf/mesh/mesh_grid.hpp"
#include "server/data/cf/mesh/source_layers.hpp"
#include "server/data/cf/mesh/topology.hpp"

namespace windsplat::data::cf {

namespace {

using Indices = std::vector<std::size_t>;

class MeshedFile final : public ArrayFile {
 public:
  MeshedFile(std::unique_ptr<ArrayFile> base, Topology topology, MeshGrid grid, MeshContents shown)
      : base_(std::move(base)),
        grid_(std::move(grid)),
        shown_(std::move(shown)),
        layers_(*base_),
        edges_(std::move(topology), shown_.edges) {
    if (const auto bytes = base_->stored_bytes()) set_stored_bytes(*bytes);
  }

  [[nodiscard]] const FileContents& contents() const override { return shown_.contents; }
  [[nodiscard]] const std::string& name() const override { return base_->name(); }
  [[nodiscard]] std::string origin() const override { return base_->origin(); }
  [[nodiscard]] std::string format() const override { return base_->format(); }
  [[nodiscard]] std::string identity() const override { return base_->identity(); }

  [[nodiscard]] Numbers numbers(int variable, const char* attribute) const override {
    const MeshPart& own = part(variable);
    return own.base < 0 || own.location ? Numbers() : base_->numbers(own.base, attribute);
  }
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override {
    const MeshPart& own = part(variable);
    return own.base < 0 ? std::string() : base_->text_of(own.base, attribute);
  }
  [[nodiscard]] Indices chunk(int variable) const override {
    const MeshPart& own = part(variable);
    if (own.base >= 0 && !own.location) return base_->chunk(own.base);
    Indices out(shown_.contents.variables[at(variable)].dims.size(), 1);
    if (!own.location) return out;
    if (own.base >= 0) {
      const Indices stored = base_->chunk(own.base);
      std::copy(stored.begin(), stored.begin() + static_cast<std::ptrdiff_t>(own.list),
                out.begin());
    }
    out[out.size() - 2] = grid_.lattice().y.count;
    out.back() = grid_.lattice().x.count;
    return out;
  }
  [[nodiscard]] std::size_t chunk_cost_bytes(int variable) const override {
    const int base = part(variable).base;
    return base < 0 ? 0 : base_->chunk_cost_bytes(base);
  }
  [[nodiscard]] Unwritten unwritten(int variable, std::size_t most) const override {
    const int base = part(variable).base;
    return base < 0 ? Unwritten() : base_->unwritten(base, most);
  }
  void forget_chunks(int variable) const override {
    layers_.forget();
    held_ = {};
    if (part(variable).base >= 0) base_->forget_chunks(part(variable).base);
  }

  Result<void> read(int variable, const Indices& start, const Indices& count,
                    double* out) const override {
    const MeshPart& own = part(variable);
    if (!own.location && own.base < 0) {
      std::copy_n(own.values.begin() + static_cast<std::ptrdiff_t>(start[0]), count[0], out);
      return {};
    }
    if (!own.location) return base_->read(own.base, start, count, out);
    return read_samples(variable, start, count, out);
  }
  Result<void> read(int variable, const Indices& start, const Indices& count,
                    float* out) const override {
    const MeshPart& own = part(variable);
    if (own.location) return read_samples(variable, start, count, out);
    return base_->read(own.base, start, count, out);
  }

 private:
  // The samples of one layer.
  struct Held {
    int variable = -1;
    Indices index;
    std::vector<float> samples;
  };

  [[nodiscard]] const MeshPart& part(int variable) const { return shown_.parts.at(at(variable)); }

  // The values at the nodes of the heights of one layer; index: step and level.
  Result<const float*> height_layer(const Indices& index) const {
    const auto copy = [&](int variable, std::size_t list, const Indices& at_index) {
      auto read = layers_.read({variable, list}, at_index);
      if (!read) return Result<std::vector<float>>(read.error());
      return Result<std::vector<float>>(std::vector<float>(*read, *read + grid_.mesh().nodes()));
    };
    auto sigma = copy(shown_.heights.sigma, 1, {index[1]});
    if (!sigma) return sigma.error();
    auto depth = copy(shown_.heights.depth, 0, {});
    if (!depth) return depth.error();
    auto surface = copy(shown_.heights.surface, 1, {index[0]});
    if (!surface) return surface.error();
    computed_.resize(grid_.mesh().nodes());
    for (std::size_t n = 0; n < computed_.size(); ++n) {
      computed_[n] = (*surface)[n] + (*sigma)[n] * ((*depth)[n] + (*surface)[n]);
    }
    return computed_.data();
  }

  Result<void> hold(int variable, const Indices& index) const {
    if (held_.variable == variable && held_.index == index) return {};
    const MeshPart& own = part(variable);
    held_.variable = -1;
    auto values = own.base < 0 ? height_layer(index) : layers_.read({own.base, own.list}, index);
    if (values && own.edges) {
      values = edges_.at_cells(*base_, grid_.mesh(), *own.edges, own.missing, *values);
    }
    if (!values) return values.error();
    held_.samples.resize(grid_.lattice().samples());
    grid_.weights(*own.location).gather(*values, held_.samples.data());
    held_.variable = variable;
    held_.index = index;
    return {};
  }

  template <class T>
  Result<void> read_samples(int variable, const Indices& start, const Indices& count,
                            T* out) const {
    const std::size_t outer = start.size() - 2;
    const std::size_t layers =
        std::accumulate(count.begin(), count.begin() + static_cast<std::ptrdiff_t>(outer),
                        std::size_t{1}, std::multiplies<>());
    Indices index(start.begin(), start.begin() + static_cast<std::ptrdiff_t>(outer));
    for (std::size_t layer = 0; layer < layers; ++layer) {
      std::size_t rest = layer;
      for (std::size_t d = outer; d-- > 0;) {
        index[d] = start[d] + rest % count[d];
        rest /= count[d];
      }
      if (auto done = hold(variable, index); !done) return done;
      for (std::size_t j = 0; j < count[outer]; ++j) {
        const float* row =
            held_.samples.data() + (start[outer] + j) * grid_.lattice().x.count + start.back();
        out = std::copy_n(row, count.back(), out);
      }
    }
    return {};
  }

  std::unique_ptr<ArrayFile> base_;
  mutable MeshGrid grid_;
  MeshContents shown_;
  mutable SourceLayers layers_;
  mutable EdgeValues edges_;
  mutable Held held_;
  mutable std::vector<float> computed_;
};

// Samples of a lattice that take a quarter of the memory for opening files of so many bytes.
std::size_t samples_for(const std::optional<std::uint64_t>& stored_bytes) {
  if (!stored_bytes) return samples_max;
  return std::max(samples_of_small_mesh,
                  static_cast<std::size_t>(opening_memory_bytes(*stored_bytes) / 4 /
                                           MeshGrid::bytes_of_sample));
}

}  // namespace

Result<std::unique_ptr<ArrayFile>> meshed(std::unique_ptr<ArrayFile> file) {
  const auto topology = find_topology(*file);
  if (!topology) return file;
  const auto named = [&](const Error& error) {
    return make_error(error.kind, in_quotes(file->name()) + ": " + error.message);
  };
  std::vector<std::string> notes;
  auto mesh = read_mesh(*file, *topology, notes);
  if (!mesh) return named(mesh.error());
  auto grid = MeshGrid::of(std::move(*mesh), samples_for(file->stored_bytes()));
  if (!grid) return named(grid.error());
  auto shown = contents_on_lattice(*file, *topology, grid->mesh(), grid->lattice());
  if (!shown) return named(shown.error());
  const auto fits = check_centers(*file, shown->cell_dimensions, grid->mesh());
  if (!fits) return named(fits.error());
  for (std::string& note :
       grid->notes(topology->convention, shown->most(), topology->by_neighbours)) {
    notes.push_back(std::move(note));
  }
  auto& all = shown->contents.notes;
  all.insert(all.end(), notes.begin(), notes.end());
  return std::unique_ptr<ArrayFile>(std::make_unique<MeshedFile>(
      std::move(file), *topology, std::move(*grid), std::move(*shown)));
}

}  // namespace windsplat::data::cf
