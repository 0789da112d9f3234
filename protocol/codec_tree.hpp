// The codec's JSON tree, and how one is taken apart: without asking for memory.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace windsplat::protocol {

// The system's allocator under a name of ours, which makes the tree a type of ours.
template <class T>
struct TreeAllocator : std::allocator<T> {
  TreeAllocator() = default;
  template <class U>
  TreeAllocator(const TreeAllocator<U>& /*other*/) noexcept {}
  template <class U>
  struct rebind {
    using other = TreeAllocator<U>;
  };
};

// Objects are sorted by key, which is what makes text canonical.
using Json = nlohmann::basic_json<std::map, std::vector, std::string, bool, std::int64_t,
                                  std::uint64_t, double, TreeAllocator>;

template <class T>
void free_node(T* node) {
  if (node == nullptr) return;
  std::destroy_at(node);
  TreeAllocator<T>().deallocate(node, 1);
}

}  // namespace windsplat::protocol

// The library's own (3.11) copies the children to a new vector first, so that deep trees do not use
// the stack up; with no memory for that vector the destructor ends the program. Trees of the codec
// are at most json_depth_max deep.
template <>
inline void windsplat::protocol::Json::json_value::destroy(
    windsplat::protocol::Json::value_t type) {
  switch (type) {
    case windsplat::protocol::Json::value_t::object:
      return windsplat::protocol::free_node(object);
    case windsplat::protocol::Json::value_t::array:
      return windsplat::protocol::free_node(array);
    case windsplat::protocol::Json::value_t::string:
      return windsplat::protocol::free_node(string);
    case windsplat::protocol::Json::value_t::binary:
      return windsplat::protocol::free_node(binary);
    default:
      return;
  }
}
