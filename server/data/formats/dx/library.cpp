// References -> objects; arrays -> byte stores, with sizes checked against the file.
#include "server/data/formats/dx/library.hpp"

#include <bit>
#include <utility>

#include "server/data/bytes/unrolled.hpp"

namespace windsplat::data::dx {

namespace {

constexpr std::size_t files_max = 256;

}  // namespace

Result<Found> Library::root(const std::shared_ptr<const InputFile>& file) {
  auto module = parse_module(file);
  if (!module) return module.error();
  identity_ += file->identity() + '\n';
  auto& kept = modules_[""];
  kept = std::make_unique<Module>(std::move(*module));
  const Object* object = kept->find("");
  if (object == nullptr) return file->fault("has no object " + in_quotes(kept->chosen));
  return Found{kept.get(), object};
}

Result<std::shared_ptr<const InputFile>> Library::open(const std::string& name) {
  if (const auto at = opened_.find(name); at != opened_.end()) return at->second;
  if (opened_.size() == files_max) {
    return make_error(ErrorKind::bad_data,
                      "more than " + std::to_string(files_max) + " files are referred to");
  }
  auto file = files_->open(name);
  if (!file) return file.error();
  identity_ += (*file)->identity() + '\n';
  opened_[name] = *file;
  return *file;
}

Result<Found> Library::find(const Found& from, const Reference& reference) {
  const Module* module = from.module;
  if (!reference.file.empty()) {
    auto& kept = modules_[reference.file];
    if (!kept) {
      auto file = open(reference.file);
      if (!file) return file.error();
      auto parsed = parse_module(*file);
      if (!parsed) return parsed.error();
      kept = std::make_unique<Module>(std::move(*parsed));
    }
    module = kept.get();
  }
  const Object* object = module->find(reference.name);
  if (object == nullptr) {
    return module->file->fault("has no object " + in_quotes(reference.name));
  }
  return Found{module, object};
}

Result<bytes::Placement> Library::place(const Found& array) {
  const Object& object = *array.object;
  const std::shared_ptr<const InputFile>& here = array.module->file;
  if (object.kind != Class::array || !object.numbers || !object.has_data) {
    return here->fault("has in the object " + in_quotes(object.name) + " of class " +
                       printable(object.class_name, 40) + " no numbers that can be read");
  }
  auto file = object.data_file.empty() ? Result<std::shared_ptr<const InputFile>>(here)
                                       : open(object.data_file);
  if (!file) return file.error();
  const std::uint64_t base =
      object.data_file.empty() && !object.follows ? array.module->data_begin : 0;
  const std::uint64_t size = (*file)->size();
  bytes::Placement out;
  out.type = object.text ? bytes::Scalar::float64 : object.type;
  out.big_endian = object.text ? std::endian::native == std::endian::big : object.big_endian;
  std::vector<std::uint64_t> factors = object.shape;
  factors.push_back(object.items);
  factors.push_back(bytes::size_of(out.type));
  const auto total = bytes::product(factors);
  const bool begins = object.data_at <= size && base <= size - object.data_at;
  const std::uint64_t at = begins ? base + object.data_at : size;
  const bool fits = total && begins &&
                    (object.text ? bytes::can_hold(bytes::Encoding::text, size - at, *total)
                                 : *total <= size - at);
  if (!fits) {
    return (*file)->fault("is truncated: the array " + in_quotes(object.name) + " of " +
                          std::to_string(object.items) + " items does not fit into the " +
                          std::to_string(size - at) + " bytes from byte " + std::to_string(at) +
                          " on");
  }
  out.store = object.text ? bytes::unrolled_store(*file, bytes::Encoding::text, at, *total)
                          : bytes::file_store(*file, at);
  return out;
}

Result<std::vector<double>> Library::numbers(const Found& array, std::uint64_t count_max) {
  auto place = this->place(array);
  if (!place) return place.error();
  std::vector<std::uint64_t> factors = array.object->shape;
  factors.push_back(array.object->items);
  const auto count = bytes::product(factors);
  if (!count || *count > count_max) {
    return array.module->file->fault("has positions of more than " + std::to_string(count_max) +
                                     " numbers");
  }
  const std::size_t size = bytes::size_of(place->type);
  std::vector<unsigned char> raw(*count * size);
  if (auto done = place->store->read(0, raw.data(), raw.size()); !done) return done.error();
  std::vector<double> out(*count);
  bytes::decode(place->type, place->big_endian, raw.data(), size, out.size(), out.data());
  return out;
}

}  // namespace windsplat::data::dx
