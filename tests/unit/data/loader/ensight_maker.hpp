// Small cases of EnSight Gold, written as the format is documented ("EnSight User Manual", "EnSight
// Gold Casefile Format"), independently of the program under test.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace windsplat::data::test {

enum class EnSightCoding { text, little, big };

// A geometry or variable file.
class EnSightFile {
 public:
  EnSightFile(const std::string& path, EnSightCoding coding)
      : out_(path, std::ios::binary), coding_(coding) {}

  void line(const std::string& text) {
    if (coding_ == EnSightCoding::text) {
      out_ << text << '\n';
      return;
    }
    std::string padded = text;
    padded.resize(80, ' ');
    out_ << padded;
  }
  void begin_geometry() {
    if (coding_ != EnSightCoding::text) line("C Binary");
  }
  // A line of whole numbers, 10 columns each.
  void numbers(const std::vector<int>& all) {
    for (const int one : all) {
      if (coding_ == EnSightCoding::text) {
        std::array<char, 16> text{};
        std::snprintf(text.data(), text.size(), "%10d", one);
        out_ << text.data();
      } else {
        bytes(static_cast<std::int32_t>(one));
      }
    }
    if (coding_ == EnSightCoding::text) out_ << '\n';
  }
  // One in a line.
  void values(const std::vector<double>& all) {
    for (const double one : all) {
      if (coding_ == EnSightCoding::text) {
        std::array<char, 24> text{};
        std::snprintf(text.data(), text.size(), "%12.5e\n", one);
        out_ << text.data();
      } else {
        bytes(static_cast<float>(one));
      }
    }
  }

 private:
  template <class T>
  void bytes(T value) {
    std::array<char, sizeof(T)> all{};
    std::memcpy(all.data(), &value, sizeof(T));
    if (coding_ == EnSightCoding::big) std::reverse(all.begin(), all.end());
    out_.write(all.data(), all.size());
  }

  std::ofstream out_;
  EnSightCoding coding_;
};

// One part: hexahedra of a side of h, with values of nodes and elements.
struct EnSightBox {
  std::array<int, 3> cells{4, 3, 2};
  std::array<double, 3> origin{0, 0, 0};
  double h = 0.25;

  [[nodiscard]] std::vector<std::array<double, 3>> places(bool centres) const {
    const double half = centres ? 0.5 : 0;
    const int more = centres ? 0 : 1;
    std::vector<std::array<double, 3>> out;
    for (int k = 0; k < cells[2] + more; ++k) {
      for (int j = 0; j < cells[1] + more; ++j) {
        for (int i = 0; i < cells[0] + more; ++i) {
          out.push_back(
              {origin[0] + h * (i + half), origin[1] + h * (j + half), origin[2] + h * (k + half)});
        }
      }
    }
    return out;
  }
};

inline void write_geometry(const std::string& path, EnSightCoding coding,
                           const std::vector<EnSightBox>& parts) {
  EnSightFile file(path, coding);
  file.begin_geometry();
  file.line("geometry of a test");
  file.line("second line");
  file.line("node id off");
  file.line("element id off");
  int number = 0;
  for (const EnSightBox& box : parts) {
    file.line("part");
    file.numbers({++number});
    file.line("part " + std::to_string(number));
    file.line("coordinates");
    const auto places = box.places(false);
    file.numbers({static_cast<int>(places.size())});
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<double> all;
      for (const auto& place : places) all.push_back(place.at(axis));
      file.values(all);
    }
    file.line("hexa8");
    file.numbers({box.cells[0] * box.cells[1] * box.cells[2]});
    const auto point = [&](int i, int j, int k) {
      return 1 + i + (box.cells[0] + 1) * (j + (box.cells[1] + 1) * k);
    };
    for (int k = 0; k < box.cells[2]; ++k) {
      for (int j = 0; j < box.cells[1]; ++j) {
        for (int i = 0; i < box.cells[0]; ++i) {
          file.numbers({point(i, j, k), point(i + 1, j, k), point(i + 1, j + 1, k),
                        point(i, j + 1, k), point(i, j, k + 1), point(i + 1, j, k + 1),
                        point(i + 1, j + 1, k + 1), point(i, j + 1, k + 1)});
        }
      }
    }
  }
}

// values: of a place; 1 or 3 components.
inline void write_variable(
    const std::string& path, EnSightCoding coding, const std::vector<EnSightBox>& parts,
    bool of_elements,
    const std::function<std::vector<double>(const std::array<double, 3>&)>& values) {
  EnSightFile file(path, coding);
  file.line("variable of a test");
  int number = 0;
  for (const EnSightBox& box : parts) {
    file.line("part");
    file.numbers({++number});
    file.line(of_elements ? "hexa8" : "coordinates");
    std::vector<std::vector<double>> components;
    for (const auto& place : box.places(of_elements)) {
      const auto one = values(place);
      components.resize(one.size());
      for (std::size_t c = 0; c < one.size(); ++c) components[c].push_back(one[c]);
    }
    for (const auto& component : components) file.values(component);
  }
}

}  // namespace windsplat::data::test
