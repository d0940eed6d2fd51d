#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "layfigure/cache/fields.h"

/// Values as bytes and back, for the same program on the same machine: numbers, enumerations, strings, Eigen's matrices
/// of fixed size, quaternions and transforms, the standard containers, and plain structs of such, field by field.
namespace layfigure::cache {

/// Appends values to a string of bytes.
class ByteWriter {
 public:
  ByteWriter() = default;
  /// To one that is empty but may have room.
  explicit ByteWriter(std::string room) : bytes_(std::move(room)) {}
  template <class T>
  void plain(const T* values, std::size_t count) {
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  template <class Container>
  void size(const Container& container) {
    const std::size_t count = container.size();
    plain(&count, 1);
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Takes values from bytes; throws std::runtime_error if they end too early.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  void plain(T* values, std::size_t count) {
    require(count, sizeof(T));
    if (count > 0) std::memcpy(static_cast<void*>(values), bytes_.data(), count * sizeof(T));
    bytes_.remove_prefix(count * sizeof(T));
  }
  /// Takes a container's size and gives it that.
  template <class Container>
  void size(Container& container) {
    container.resize(count());
  }
  [[nodiscard]] std::size_t count() {
    std::size_t count = 0;
    plain(&count, 1);
    require(count, 1);  // every element takes a byte or more
    return count;
  }
  void finish() const {
    if (!bytes_.empty()) throw std::runtime_error("bytes are left over");
  }

 private:
  void require(std::size_t count, std::size_t size) const {
    if (count > bytes_.size() / size) throw std::runtime_error("the bytes end too early");
  }

  std::string_view bytes_;
};

// One description of each layout for both directions.

template <class Archive, class T>
void transfer(Archive& archive, T& value);

namespace detail {

template <class T>
inline constexpr bool is_number = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Vectors and matrices of fixed size, of numbers alone.
template <class T>
struct IsBlock : std::bool_constant<is_number<T>> {};
template <class T, int rows, int columns>
struct IsBlock<Eigen::Matrix<T, rows, columns>>
    : std::bool_constant<rows != Eigen::Dynamic && columns != Eigen::Dynamic> {
  static_assert(sizeof(Eigen::Matrix<T, rows, columns>) == sizeof(T) * rows * columns);
};
template <class T>
struct IsBlock<Eigen::Quaternion<T>> : std::true_type {};
template <class T, int dimension, int mode>
struct IsBlock<Eigen::Transform<T, dimension, mode>> : std::true_type {};

template <class Archive>
void transfer_parts(Archive& archive, std::string& text) {
  archive.size(text);
  archive.plain(text.data(), text.size());
}

template <class Archive, class T>
void transfer_parts(Archive& archive, std::vector<T>& items) {
  archive.size(items);
  if constexpr (std::is_same_v<T, bool>) {
    for (std::size_t k = 0; k < items.size(); ++k) {
      bool item = items[k];
      transfer(archive, item);
      items[k] = item;
    }
  } else if constexpr (IsBlock<T>::value) {
    archive.plain(items.data(), items.size());
  } else {
    for (T& item : items) transfer(archive, item);
  }
}

template <class Archive, class T, std::size_t count>
void transfer_parts(Archive& archive, std::array<T, count>& items) {
  for (T& item : items) transfer(archive, item);
}

template <class Archive, class A, class B>
void transfer_parts(Archive& archive, std::pair<A, B>& pair) {
  transfer(archive, pair.first);
  transfer(archive, pair.second);
}

template <class Archive, class T>
void transfer_parts(Archive& archive, std::optional<T>& item) {
  bool is_there = item.has_value();
  transfer(archive, is_there);
  if (!is_there) return;
  if (!item) item.emplace();
  transfer(archive, *item);
}

template <class Key, class T>
void transfer_parts(ByteWriter& writer, std::map<Key, T>& items) {
  writer.size(items);
  for (std::pair<Key, T> entry : items) transfer(writer, entry);
}

template <class Key, class T>
void transfer_parts(ByteReader& reader, std::map<Key, T>& items) {
  for (std::size_t left = reader.count(); left > 0; --left) {
    Key key{};
    transfer(reader, key);
    transfer(reader, items[std::move(key)]);
  }
}

/// Gives `item` the alternative of that index.
template <class... Types>
void choose(std::variant<Types...>& item, std::size_t index) {
  std::size_t k = 0;
  if (((k++ == index ? (item.template emplace<Types>(), true) : false) || ...)) return;
  throw std::runtime_error("the bytes name an alternative that does not exist");
}

template <class Archive, class... Types>
void transfer_parts(Archive& archive, std::variant<Types...>& item) {
  std::size_t index = item.index();
  transfer(archive, index);
  if (index != item.index()) choose(item, index);
  std::visit([&](auto& alternative) { transfer(archive, alternative); }, item);
}

template <class Archive, class T>
void transfer_parts(Archive& archive, T& object) {
  visit_fields(object, [&](auto&... fields) { (transfer(archive, fields), ...); });
}

}  // namespace detail

/// Writes `value` to the archive, or takes it from there.
template <class Archive, class T>
void transfer(Archive& archive, T& value) {
  if constexpr (detail::IsBlock<T>::value) {
    archive.plain(&value, 1);
  } else {
    detail::transfer_parts(archive, value);
  }
}

/// Writes `value` in place of what `bytes` held: allocates only for more than that ever had room for.
template <class T>
void write_bytes(const T& value, std::string& bytes) {
  bytes.clear();
  ByteWriter writer(std::move(bytes));
  transfer(writer, const_cast<T&>(value));  // a writer changes nothing
  bytes = writer.take();
}

template <class T>
[[nodiscard]] std::string to_bytes(const T& value) {
  std::string bytes;
  write_bytes(value, bytes);
  return bytes;
}

/// The value of to_bytes(). Throws std::runtime_error if the bytes are not one whole value; that its numbers make sense
/// is for the caller to see.
template <class T>
[[nodiscard]] T from_bytes(std::string_view bytes) {
  ByteReader reader(bytes);
  T value{};
  transfer(reader, value);
  reader.finish();
  return value;
}

}  // namespace layfigure::cache
