// SPDX-License-Identifier: Apache-2.0
#include <gsc/checksum.h>

// note: the whole of xxHash is compiled in here, so that users of gsc_format need neither its library nor its header
#define XXH_INLINE_ALL
#include <xxhash.h>

namespace gsc {

struct Checksum64::State {
    XXH3_state_t xxh; // its type asks for a large alignment, which operator new respects
};

uint64_t checksum64(std::span<const std::byte> bytes)
{
    return XXH3_64bits(bytes.data(), bytes.size());
}

Checksum64::Checksum64() : m_state(std::make_unique<State>())
{
    XXH3_64bits_reset(&m_state->xxh);
}

Checksum64::~Checksum64() = default;
Checksum64::Checksum64(Checksum64&&) noexcept = default;
Checksum64& Checksum64::operator=(Checksum64&&) noexcept = default;

void Checksum64::update(std::span<const std::byte> bytes)
{
    if (!bytes.empty())
        XXH3_64bits_update(&m_state->xxh, bytes.data(), bytes.size());
}

uint64_t Checksum64::digest() const
{
    return XXH3_64bits_digest(&m_state->xxh);
}

} // namespace gsc
