// Small VTK files as bytes, encoded here independently of the program under test.
#pragma once

#include <gtest/gtest.h>
#include <lz4.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"

namespace windsplat::data::vtk_test {

// A folder for the files of one test.
class VtkFolder {
 public:
  VtkFolder() {
    std::string pattern =
        (std::filesystem::temp_directory_path() / "windsplat-vtk-XXXXXX").native();
    path_ = ::mkdtemp(pattern.data());
  }
  ~VtkFolder() { std::filesystem::remove_all(path_); }
  VtkFolder(const VtkFolder&) = delete;
  VtkFolder& operator=(const VtkFolder&) = delete;

  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }
  std::string path(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

template <class T>
std::string bytes_of_number(T value, bool big) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big) std::reverse(bytes.begin(), bytes.end());  // the tests run on little-endian machines
  return bytes;
}

inline std::string packed(const std::string& type, const std::vector<double>& values, bool big) {
  std::string out;
  for (const double v : values) {
    if (type == "Int8") out += bytes_of_number(static_cast<std::int8_t>(v), big);
    if (type == "UInt8") out += bytes_of_number(static_cast<std::uint8_t>(v), big);
    if (type == "Int16") out += bytes_of_number(static_cast<std::int16_t>(v), big);
    if (type == "UInt16") out += bytes_of_number(static_cast<std::uint16_t>(v), big);
    if (type == "Int32") out += bytes_of_number(static_cast<std::int32_t>(v), big);
    if (type == "UInt32") out += bytes_of_number(static_cast<std::uint32_t>(v), big);
    if (type == "Int64") out += bytes_of_number(static_cast<std::int64_t>(v), big);
    if (type == "UInt64") out += bytes_of_number(static_cast<std::uint64_t>(v), big);
    if (type == "Float32") out += bytes_of_number(static_cast<float>(v), big);
    if (type == "Float64") out += bytes_of_number(v, big);
  }
  return out;
}

inline std::string base64(const std::string& bytes) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      bits = bits << 8 | (i + j < bytes.size() ? static_cast<unsigned char>(bytes[i + j]) : 0U);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      out += i + j < bytes.size() + 1 ? letters[bits >> (18 - 6 * j) & 63] : '=';
    }
  }
  return out;
}

// Encoding of a VTK XML file.
struct VtkCoding {
  std::string format = "ascii";  // ascii, base64 (inline), appended-raw, appended-base64
  std::string compressor;        // "", "ZLib", "LZ4"
  bool big = false;
  int header_bytes = 4;
};

class VtkXml {
 public:
  explicit VtkXml(VtkCoding coding = {}) : coding_(std::move(coding)) {}

  std::string array(const std::string& type, const std::string& name, int components,
                    const std::vector<double>& values, const std::string& more = "") {
    std::string tag = "<DataArray type=\"" + type + "\" Name=\"" + name +
                      "\" NumberOfComponents=\"" + std::to_string(components) + "\" " + more;
    if (coding_.format == "ascii")
      return tag + " format=\"ascii\">\n" + text(values) + "</DataArray>\n";
    const std::string bytes = packed(type, values, coding_.big);
    if (coding_.format == "base64") {
      return tag + " format=\"binary\">\n  " + encoded(bytes, true) + "\n</DataArray>\n";
    }
    tag += " format=\"appended\" offset=\"" + std::to_string(appended_.size()) + "\"/>\n";
    appended_ += encoded(bytes, coding_.format == "appended-base64");
    return tag;
  }

  // The whole document: `inner` is the content of the element `type`.
  std::string file(const std::string& type, const std::string& attributes,
                   const std::string& inner) const {
    std::string out = "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + type + "\" version=\"1.0\" ";
    out += coding_.big ? "byte_order=\"BigEndian\"" : "byte_order=\"LittleEndian\"";
    out += coding_.header_bytes == 8 ? " header_type=\"UInt64\"" : " header_type=\"UInt32\"";
    if (!coding_.compressor.empty())
      out += " compressor=\"vtk" + coding_.compressor + "DataCompressor\"";
    out += ">\n<" + type + " " + attributes + ">\n" + inner + "</" + type + ">\n";
    if (!appended_.empty()) {
      out += "<AppendedData encoding=\"";
      out += coding_.format == "appended-raw" ? "raw" : "base64";
      out += "\">\n _" + appended_ + "\n</AppendedData>\n";
    }
    return out + "</VTKFile>\n";
  }

  // An image with one piece of the whole extent.
  std::string image(std::array<int, 3> dims, const std::string& attributes,
                    const std::string& point_data, const std::string& cell_data = "") const {
    std::string extent = "0 " + std::to_string(dims[0] - 1) + " 0 " + std::to_string(dims[1] - 1);
    extent += " 0 " + std::to_string(dims[2] - 1);
    return file("ImageData", "WholeExtent=\"" + extent + "\" " + attributes,
                "<Piece Extent=\"" + extent + "\"><PointData>" + point_data +
                    "</PointData><CellData>" + cell_data + "</CellData></Piece>");
  }

  static std::string text(const std::vector<double>& values) {
    std::ostringstream out;
    out.precision(17);
    for (std::size_t i = 0; i < values.size(); ++i) out << values[i] << (i % 5 == 4 ? '\n' : ' ');
    return out.str();
  }

 private:
  std::string number(std::size_t n) const {
    return coding_.header_bytes == 8 ? bytes_of_number(static_cast<std::uint64_t>(n), coding_.big)
                                     : bytes_of_number(static_cast<std::uint32_t>(n), coding_.big);
  }

  // A header and its data; without a compressor they are one unit of base64, otherwise two.
  std::string encoded(const std::string& bytes, bool as_text) const {
    if (coding_.compressor.empty()) {
      const std::string all = number(bytes.size()) + bytes;
      return as_text ? base64(all) : all;
    }
    constexpr std::size_t block = 96;  // few bytes, so that arrays have several blocks and a
                                       // shorter last one
    std::string header =
        number((bytes.size() + block - 1) / block) + number(block) + number(bytes.size() % block);
    std::string data;
    for (std::size_t at = 0; at < bytes.size(); at += block) {
      const std::string plain = bytes.substr(at, block);
      std::string small(plain.size() * 2 + 256, '\0');
      if (coding_.compressor == "ZLib") {
        uLongf size = small.size();
        ::compress(reinterpret_cast<Bytef*>(small.data()), &size,
                   reinterpret_cast<const Bytef*>(plain.data()), plain.size());
        small.resize(size);
      } else {
        const int size =
            ::LZ4_compress_default(plain.data(), small.data(), static_cast<int>(plain.size()),
                                   static_cast<int>(small.size()));
        small.resize(static_cast<std::size_t>(size));
      }
      header += number(small.size());
      data += small;
    }
    return as_text ? base64(header) + base64(data) : header + data;
  }

  VtkCoding coding_;
  std::string appended_;
};

// A field of a source at a step.
inline Volume volume_of(Source& source, const std::string& field, std::size_t step = 0) {
  const FieldInfo* found = source.info().find(field);
  if (found == nullptr) {
    ADD_FAILURE() << "no field " << field;
    return {};
  }
  auto volume = source.read(static_cast<std::size_t>(found - source.info().fields.data()), step);
  if (!volume) {
    ADD_FAILURE() << volume.error().message;
    return {};
  }
  return std::move(*volume);
}

inline std::unique_ptr<Source> opened(const std::string& path) {
  auto source = open_file(path);
  if (!source) {
    ADD_FAILURE() << source.error().message;
    return nullptr;
  }
  return std::move(*source);
}

// The error message of opening, or of reading the first field.
inline std::string refusal(const std::string& path) {
  auto source = open_file(path);
  if (!source) return source.error().message;
  for (std::size_t step = 0; step < (*source)->info().steps.size(); ++step) {
    const auto volume = (*source)->read(0, step);
    if (!volume) return volume.error().message;
  }
  return "";
}

inline std::string all_notes(const DatasetInfo& info) {
  std::string out;
  for (const std::string& note : info.notes) out += note + "\n";
  return out;
}

inline std::string reason_of(const DatasetInfo& info, const std::string& name) {
  for (const LeftOut& left : info.left_out) {
    if (left.name == name) return left.reason;
  }
  return "";
}

}  // namespace windsplat::data::vtk_test
