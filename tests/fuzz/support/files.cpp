// In-memory files, and properties of reader results and of pictures made from them.
#include "tests/fuzz/support/files.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/loader/messages.hpp"
#include "server/data/model/stored.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/frame/frame.hpp"
#include "tests/fuzz/support/check.hpp"

namespace fuzz {
namespace {

using namespace windsplat;
using namespace windsplat::data;

constexpr std::size_t files_max = 64;
// Larger volumes are not read: valid, but slow.
constexpr std::size_t floats_max = std::size_t{1} << 20;
// Larger grids are not rendered.
constexpr std::size_t drawn_samples_max = std::size_t{1} << 15;

// The file name of a process with separate work: chosen by the parent, so that the next child
// overwrites the remains of a crashed one.
std::string name_on_disk() {
  return (std::filesystem::temp_directory_path() / "windsplat-fuzz-").string() +
         std::to_string(::getppid());
}

class MemoryFiles : public Files {
 public:
  MemoryFiles(std::map<std::string, std::string_view> files, Location location, bool on_disk)
      : files_(std::move(files)), location_(std::move(location)), on_disk_(on_disk) {}
  ~MemoryFiles() override {
    if (on_disk_) ::unlink(name_on_disk().c_str());
  }
  MemoryFiles(const MemoryFiles&) = delete;
  MemoryFiles& operator=(const MemoryFiles&) = delete;

  [[nodiscard]] const Location& location() const override { return location_; }

  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    const auto found = files_.find(name);
    if (found == files_.end()) {
      return make_error(ErrorKind::not_found, in_quotes(name) + " does not exist");
    }
    const int descriptor =
        on_disk_ ? ::open(name_on_disk().c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600)
                 : ::memfd_create("input", MFD_CLOEXEC);
    fuzz::expect(descriptor >= 0, "a file to be read");
    const std::string_view bytes = found->second;
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    fuzz::expect(written == static_cast<ssize_t>(bytes.size()), "a file contains its bytes");
    count_opened(name, bytes.size());
    return InputFile::adopt(descriptor, name.substr(name.find_last_of('/') + 1));
  }

  Result<std::vector<std::string>> list(const std::string& folder) override {
    const std::string begin = folder.empty() || folder.ends_with('/') ? folder : folder + '/';
    std::vector<std::string> out;
    for (const auto& [name, bytes] : files_) {
      if (!name.starts_with(begin)) continue;
      const std::string rest = name.substr(begin.size());
      const std::size_t slash = rest.find('/');
      out.push_back(slash == std::string::npos ? rest : rest.substr(0, slash + 1));
    }
    out.erase(std::unique(out.begin(), out.end()), out.end());
    if (out.empty()) return make_error(ErrorKind::not_found, in_quotes(folder) + " does not exist");
    return out;
  }

  bool exists(const std::string& name) override {
    const auto found = files_.lower_bound(name);
    return found != files_.end() && (found->first == name || found->first.starts_with(name + '/'));
  }

 private:
  std::map<std::string, std::string_view> files_;
  Location location_;
  bool on_disk_;
};

// Start of the next mark: at the start of a line.
std::size_t find_mark(std::string_view input, std::size_t from) {
  for (;;) {
    const std::size_t at = input.find(file_mark, from);
    if (at == std::string_view::npos || at == 0 || input[at - 1] == '\n') return at;
    from = at + 1;
  }
}

void expect_whole(const Volume& volume, const DatasetInfo& info, const FieldInfo& field) {
  expect(volume.dims == info.grid.dims(), "a volume has its grid's size");
  expect(static_cast<std::size_t>(volume.components) == field.components.size(),
         "a volume has its field's components");
  const std::size_t components = field.components.size();
  expect(volume.values.size() == volume.samples() * components, "a volume has all its values");
  Volume again = volume;
  expect(measure_volume(again), "a volume has common masks and no infinite values");
  expect(again.masked == volume.masked && again.range == volume.range,
         "a volume has the reported range and masks");
}

void expect_premultiplied(const engine::Image& image) {
  constexpr float slack = 1e-5F;
  for (std::size_t i = 0; i + 3 < image.rgba.size(); i += 4) {
    const float opacity = image.rgba[i + 3];
    expect(opacity >= 0 && opacity <= 1 + slack, "an opacity is between 0 and 1");
    for (std::size_t c = 0; c < 3; ++c) {
      const float color = image.rgba[i + c];
      expect(color >= 0 && color <= opacity + slack, "a color is between 0 and its opacity");
    }
  }
}

// The middle of a field, read as a box, has the values of the whole.
void expect_cut(Source& source, std::size_t field, std::size_t step, const Volume& whole) {
  Box box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.first.at(a) = whole.dims.at(a) / 3;
    box.count.at(a) = std::max(1, whole.dims.at(a) / 3);
  }
  const auto part = source.read_part(field, step, {box});
  if (!part) {  // of a service, whose answer is not among the files
    expect(part.error().kind != ErrorKind::internal, "no file may cause an internal error",
           part.error().message);
    return;
  }
  const Volume wanted = cut(whole, box);
  expect(part->dims == wanted.dims && part->bytes() == wanted.bytes() &&
             std::memcmp(part->component(0), wanted.component(0), wanted.bytes()) == 0,
         "a box has the values of the whole");
}

// Boxes of what is stored of a field at the levels of its store.
void read_levels(Source& source, std::size_t field, std::size_t step) {
  const DatasetInfo& info = source.info();
  const std::size_t levels = info.stored ? info.stored->levels.size() : 0;
  for (std::size_t level = 1; level < levels; ++level) {
    for (const StoredAs as : {StoredAs::two_values, StoredAs::drawn, StoredAs::strided}) {
      const auto dims = stored_dims(info, field, level, as);
      if (!dims) continue;
      StoredPart wanted{whole_box(*dims), level, as};
      for (std::size_t a = 0; a < 3; ++a) {
        wanted.box.first.at(a) = dims->at(a) / 3;
        wanted.box.count.at(a) -= wanted.box.first.at(a);
      }
      auto part = source.read_part(field, step, wanted);
      if (!part) {
        expect(part.error().kind != ErrorKind::internal, "no file may cause an internal error",
               part.error().message);
        continue;
      }
      expect(part->dims == wanted.box.count &&
                 part->components == components_of(info.fields[field], as),
             "a box of a level has the size that was asked for");
      expect(measure_part(info, field, step, as, *part), "values of a level are what they may be");
    }
  }
}

// The default view except for size and threshold, with both methods of streams.
void draw(std::unique_ptr<FileSource> source) {
  if (source->info().grid.samples() > drawn_samples_max) return;
  const int last_step = static_cast<int>(source->info().steps.size()) - 1;
  Dataset dataset(std::move(source), "a", std::uint64_t{64} << 20);
  ThreadPool pool(1);
  for (const auto method : {protocol::MethodName::kernel, protocol::MethodName::slab}) {
    protocol::View view;
    view.dataset = "a";
    view.step = last_step;
    view.image.width = 16;
    view.image.height = 12;
    view.method.name = method;
    view.vector.min_magnitude = 0;
    frame::Encoding encoding;
    encoding.format = frame::Format::npy;  // keeps the linear picture
    frame::Workspace workspace;
    const auto draw = [&]() -> Result<void> {
      const auto completed = frame::complete(view, dataset);
      if (!completed) return completed.error();
      const auto prepared =
          frame::prepare(*completed, frame::own_setting(*completed), dataset, encoding);
      if (!prepared) return prepared.error();
      return frame::draw(*prepared, dataset, pool, CancelToken(), workspace);
    };
    const auto done = draw();
    if (done) {
      expect_premultiplied(workspace.space.image());
    } else {
      expect(done.error().kind != ErrorKind::internal, "no file may cause an internal error",
             done.error().message);
    }
  }
}

}  // namespace

std::string_view first_file(std::string_view input) { return input.substr(0, find_mark(input, 0)); }

std::shared_ptr<Files> files_of(std::string_view input, std::string main, Kept kept) {
  const bool folder = kept == Kept::folder;
  std::map<std::string, std::string_view> files;
  Location location;
  location.kind = folder ? Location::Kind::folder : Location::Kind::file;
  location.folder = "/nowhere";
  location.stem = main.substr(0, main.find('.'));
  location.companions = true;
  if (!folder) {
    location.members.push_back({main, {}});
    files[main] = first_file(input);
  }
  std::size_t at = find_mark(input, 0);
  while (at != std::string_view::npos && files.size() < files_max) {
    const std::size_t line = std::min(input.find('\n', at), input.size());
    const std::string name(input.substr(at + file_mark.size(), line - at - file_mark.size()));
    const std::size_t next = find_mark(input, std::min(line + 1, input.size()));
    const std::size_t begin = std::min(line + 1, input.size());
    // The line end before a mark belongs to the mark.
    const std::size_t end = next == std::string_view::npos ? input.size() : next - 1;
    if (!name.empty()) files.emplace(name, input.substr(begin, std::max(begin, end) - begin));
    at = next;
  }
  return std::make_shared<MemoryFiles>(std::move(files), std::move(location),
                                       kept == Kept::on_disk);
}

void read_dataset(const std::shared_ptr<Files>& files) {
  auto source = open_dataset(files);
  if (!source) {
    expect(!source.error().message.empty(), "a refusal has a reason");
    expect(source.error().kind != ErrorKind::internal, "no file may cause an internal error",
           source.error().message);
    return;
  }
  const DatasetInfo& info = (*source)->info();
  const std::string told = loader::encode_info(info);
  const auto believed = loader::decode_info(told);
  expect(believed.has_value(), "results of a reader pass the checks for loader messages",
         believed ? "" : believed.error().message);
  const std::size_t last_field = info.fields.size() - 1;
  const std::size_t last_step = info.steps.size() - 1;
  const std::vector<std::pair<std::size_t, std::size_t>> reads{
      {0, 0}, {last_field, last_step}, {last_field / 2, 0}};
  for (const auto& [field, step] : reads) {
    const FieldInfo& about = info.fields[field];
    if (info.grid.samples() * about.components.size() > floats_max) continue;
    read_levels(**source, field, step);
    const auto volume = (*source)->read(field, step);
    if (volume) {
      expect_whole(*volume, info, about);
      expect_cut(**source, field, step, *volume);
    } else {
      expect(volume.error().kind != ErrorKind::internal, "no file may cause an internal error",
             volume.error().message);
    }
  }
  draw(std::move(*source));
}

}  // namespace fuzz
