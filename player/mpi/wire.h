// SPDX-License-Identifier: Apache-2.0
// Messages between the ranks of gsc-play-mpi. All ranks run the same build on the same kind of machine, so plain
// structs are sent as they are; main_mpi.cpp refuses a rank of another build before the first message.
//
// Rank 0 sends a WireRequest; behind an Open request follows a WireOpen, under the renderer's tag. The other rank
// answers Open and Draw with a WireReply under the renderer's tag. Behind the reply to Draw follow the pixels of the
// drawn columns, row by row without gaps, eye after eye; each eye's depths follow its pixels if they are wanted.
// Behind a reply with an error follow only the texts of the error.
#pragma once

#include <gsc/error.h>
#include <gsc/renderer.h>

#include <mpi.h>

#include <type_traits>

namespace gsc {

enum class WireCommand : uint32_t { Open, Draw, DropCaches, Close, Quit };

struct WireRequest {
    WireCommand command = WireCommand::Quit;
    uint32_t renderer = 0; // number of the renderer, which also sets the tag of its replies
    uint64_t ticket = 0;
    uint32_t eye_count = 0;
    PixelFormat format = PixelFormat::Rgba8;
    uint32_t wants_depth = 0;
    EyeParams eyes[kMaxEyes] = {};
    FrameOptions options;
};

struct WireOpen {
    uint64_t file = 0; // checksum of the file at rank 0, by fileHash()
    uint32_t verify = 0;
    RendererOptions options;
    char backend[32] = {};
    char path[4096] = {};
};

struct WireReply {
    uint64_t ticket = 0;
    int32_t code = 0;            // error code (ErrorCode) of the request; 0 = no error
    uint32_t part_bytes[4] = {}; // lengths in bytes of the error's subject, found, expected and remedy
    uint32_t setting_count = 0;
    Setting settings[8] = {}; // settings (Error::settings) that the error names
    FrameResult result;
    // from here on set in replies to Open only
    uint32_t tier_exact = 0, tier_fast = 0; // tiers that the renderer draws exact and fast in (Renderer::tierOf())
    uint32_t processors = 0;
    uint64_t memory_bytes = 0;
    char device[128] = {};
};

static_assert(std::is_trivially_copyable_v<WireRequest> && std::is_trivially_copyable_v<WireOpen> &&
              std::is_trivially_copyable_v<WireReply>);

constexpr uint64_t kWireLayout = sizeof(WireRequest) * 1000003 + sizeof(WireOpen) * 1009 + sizeof(WireReply);
constexpr int kRequestTag = 1;
constexpr int replyTag(uint32_t renderer)
{
    return 2 + int(renderer % 30000); // MPI guarantees tags up to 32767
}

// Place of the drawn columns in one eye's image.
struct WirePart {
    // `offset`: bytes before the first drawn pixel of each row; `row`: bytes of a row's drawn pixels; `rows`: number
    // of rows
    size_t offset = 0, row = 0, rows = 0;
    [[nodiscard]] size_t bytes() const { return row * rows; }
};
inline WirePart wirePart(const FrameOptions& options, const EyeParams& eye, size_t pixel)
{
    const ColumnRange drawn = options.columns.within(eye.width);
    return {drawn.first * pixel, (drawn.end - drawn.first) * pixel, eye.height};
}

// Sends a message of any size to `rank`. The receiver must state the same number of bytes.
void wireSend(const void* data, size_t bytes, int rank, int tag);
// Receives a message from `rank`. Sleeps while waiting: MPI's own waiting keeps a core busy.
void wireReceive(void* data, size_t bytes, int rank, int tag);

} // namespace gsc
