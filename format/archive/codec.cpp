// SPDX-License-Identifier: Apache-2.0
#include "format/archive/codec.h"

#include <algorithm>
#include <cstring>

#if GSC_HAS_ZSTD
#include <zstd.h>
#endif

namespace gsc {

bool hasCodec(Codec codec)
{
    switch (codec) {
    case Codec::Raw:
    case Codec::Inverse:
        return true;
    case Codec::Zstd:
    case Codec::Morton:
    case Codec::Steps:
        return GSC_HAS_ZSTD;
    }
    return false;
}

const char* codecName(Codec codec)
{
    switch (codec) {
    case Codec::Raw:
        return "raw";
    case Codec::Zstd:
        return "zstd";
    case Codec::Morton:
        return "morton";
    case Codec::Inverse:
        return "inverse";
    case Codec::Steps:
        return "steps";
    }
    return "?";
}

#if GSC_HAS_ZSTD

struct Coder::State {
    ZSTD_CCtx* encoder = nullptr;
    ZSTD_DCtx* decoder = nullptr;
    int level = 0;
    std::vector<std::byte> planes, stored;

    ~State()
    {
        ZSTD_freeCCtx(encoder);
        ZSTD_freeDCtx(decoder);
    }
};

Coder::Coder(int level) : m_state(std::make_unique<State>())
{
    m_state->level = level;
}

bool Coder::encode(std::span<const std::byte> raw, uint32_t element, uint32_t columns, std::vector<std::byte>& out)
{
    State& s = *m_state;
    if (!s.encoder && !(s.encoder = ZSTD_createCCtx()))
        throw std::bad_alloc();
    s.planes.resize(raw.size());
    splitPlanes(raw, element, columns, s.planes.data());
    s.stored.resize(ZSTD_compressBound(raw.size()));
    const size_t bytes =
        ZSTD_compressCCtx(s.encoder, s.stored.data(), s.stored.size(), s.planes.data(), s.planes.size(), s.level);
    const bool smaller = !ZSTD_isError(bytes) && bytes < raw.size();
    const std::span<const std::byte> chosen = smaller ? std::span<const std::byte>(s.stored).first(bytes) : raw;
    out.insert(out.end(), chosen.begin(), chosen.end());
    return smaller;
}

bool Coder::decode(Codec codec, std::span<const std::byte> stored, uint32_t element, uint32_t columns,
                   std::span<std::byte> out)
{
    State& s = *m_state;
    if (codec == Codec::Raw) {
        if (stored.size() != out.size())
            return false;
        std::copy(stored.begin(), stored.end(), out.begin());
        return true;
    }
    if (codec != Codec::Zstd)
        return false;
    if (!s.decoder && !(s.decoder = ZSTD_createDCtx()))
        throw std::bad_alloc();
    const bool planar = element > 1 || columns > 1;
    if (planar)
        s.planes.resize(out.size());
    std::byte* const to = planar ? s.planes.data() : out.data();
    // decodes in one pass into memory of the declared size: a stored frame that holds more bytes, or that asks for a
    // large window, gets no further memory
    if (ZSTD_decompressDCtx(s.decoder, to, out.size(), stored.data(), stored.size()) != out.size())
        return false;
    if (planar)
        joinPlanes(s.planes.data(), element, columns, out);
    return true;
}

#else

struct Coder::State {};

Coder::Coder(int) {}

bool Coder::encode(std::span<const std::byte> raw, uint32_t, uint32_t, std::vector<std::byte>& out)
{
    out.insert(out.end(), raw.begin(), raw.end());
    return false;
}

bool Coder::decode(Codec codec, std::span<const std::byte> stored, uint32_t, uint32_t, std::span<std::byte> out)
{
    if (codec != Codec::Raw || stored.size() != out.size())
        return false;
    std::copy(stored.begin(), stored.end(), out.begin());
    return true;
}

#endif

Coder::~Coder() = default;
Coder::Coder(Coder&&) noexcept = default;
Coder& Coder::operator=(Coder&&) noexcept = default;

} // namespace gsc
