// The JSON tree of the codec, with a destructor that does not allocate.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace windsplat::protocol {

// The standard allocator under another name, which makes the tree a distinct type.
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

// Objects are sorted by key, as required by the canonical text.
using Json = nlohmann::basic_json<std::map, std::vector, std::string, bool, std::int64_t,
                                  std::uint64_t, double, TreeAllocator>;

template <class T>
void free_node(T* node) {
  if (node == nullptr) return;
  std::destroy_at(node);
  TreeAllocator<T>().deallocate(node, 1);
}

}  // namespace windsplat::protocol

// Replaces the destructor of the library (3.11), which moves children to a new vector to avoid deep
// recursion; if that allocation fails, the program terminates. The trees of the codec are at most
// json_depth_max deep, so recursion is safe.
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
