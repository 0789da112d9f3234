// Subject, setting, machine and precision as a string -> its hash.
#include "server/study/keys.hpp"

#include <array>
#include <cstdio>

#include "protocol/codec.hpp"
#include "server/study/points_file.hpp"

namespace windsplat::study {

namespace {

std::string exactly(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), " %.17g", value);
  return text.data();
}

// Everything that determines the numbers of a scene, except reference and setting.
std::string identity(const Subject& subject, const Machine& machine) {
  std::string text = "windsplat " + machine.program;
  text += ' ';
  text += subject.dataset->info().digest;
  text += ' ';
  text += protocol::encode_view(subject.view);
  return text;
}

std::string words_of(const Setting& setting) {
  std::string text = name_of(setting.method);
  text += ' ';
  text += name_of(setting.compositing);
  for (const Knob knob :
       {Knob::stride, Knob::span, Knob::slab_thickness, Knob::stop_transmittance, Knob::width}) {
    text += exactly(value_of(setting.knobs, knob));
  }
  return text;
}

}  // namespace

std::string truth_key(const Subject& subject, const Machine& machine, double tolerance) {
  return key_of(identity(subject, machine) + " integral" + exactly(tolerance));
}

std::string point_key(const Subject& subject, const Setting& setting, const Machine& machine,
                      const Measuring& measuring) {
  std::string text = identity(subject, machine);
  text += measuring.integral ? " integral" + exactly(measuring.tolerance) : " extrapolated";
  text += ' ';
  text += words_of(setting);
  text += " runs " + std::to_string(measuring.runs);
  text += " threads " + std::to_string(machine.threads);
  text += ' ';
  text += machine.kernels;
  text += ' ';
  text += machine.processor;
  return key_of(text);
}

}  // namespace windsplat::study
