// SPDX-License-Identifier: Apache-2.0
// XXH3-64 with seed 0, the only kind of checksum in a .gsc file; the source files have it too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace gsc {

[[nodiscard]] uint64_t checksum64(std::span<const std::byte> bytes);

// Checksum of bytes that come in pieces; equals checksum64() of all pieces joined.
class Checksum64 {
public:
    Checksum64();
    ~Checksum64();
    Checksum64(Checksum64&&) noexcept;
    Checksum64& operator=(Checksum64&&) noexcept;

    void update(std::span<const std::byte> bytes);
    [[nodiscard]] uint64_t digest() const; // checksum of the bytes so far; more may follow

private:
    struct State;
    std::unique_ptr<State> m_state;
};

} // namespace gsc
