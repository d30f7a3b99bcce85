// SPDX-License-Identifier: Apache-2.0
// Messages between the ranks of gsc-play-mpi. All ranks run the same build on the same kind of machine, so plain
// structs go as they are; main_mpi.cpp refuses a rank of another build before the first of them is sent.
//
// Rank 0 sends a WireRequest (of Open, a WireOpen follows under the renderer's tag). The other answers Open and Draw
// with a WireReply under the tag of the renderer, and Draw with the pixels of the columns that were drawn, row by row
// without gaps, eye after eye, each followed by its depths if they are wanted. A reply that is an error has its parts
// behind it, and nothing else.
#pragma once

#include <gsc/error.h>
#include <gsc/renderer.h>

#include <mpi.h>

#include <type_traits>

namespace gsc {

enum class WireCommand : uint32_t { Open, Draw, DropCaches, Close, Quit };

struct WireRequest {
    WireCommand command = WireCommand::Quit;
    uint32_t renderer = 0; // number of the renderer: tells its replies from others
    uint64_t ticket = 0;
    uint32_t eye_count = 0;
    PixelFormat format = PixelFormat::Rgba8;
    uint32_t wants_depth = 0;
    EyeParams eyes[kMaxEyes] = {};
    FrameOptions options;
};

struct WireOpen {
    uint64_t file = 0; // fileHash() of the path at rank 0
    uint32_t verify = 0;
    RendererOptions options;
    char backend[32] = {};
    char path[4096] = {};
};

struct WireReply {
    uint64_t ticket = 0;
    int32_t code = 0;            // ErrorCode
    uint32_t part_bytes[4] = {}; // lengths of an error's subject, found, expected and remedy
    uint32_t setting_count = 0;
    Setting settings[8] = {}; // settings that the error names
    FrameResult result;
    // In replies to Open
    uint32_t tier_exact = 0, tier_fast = 0; // Renderer::tierOf()
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
    return 2 + int(renderer % 30000); // MPI has 32767 tags at least
}

// Bytes of the drawn columns in an eye's image of `pixel` bytes a pixel.
struct WirePart {
    size_t offset = 0, row = 0, rows = 0; // bytes from a row's begin; bytes of a row
    [[nodiscard]] size_t bytes() const { return row * rows; }
};
inline WirePart wirePart(const FrameOptions& options, const EyeParams& eye, size_t pixel)
{
    const ColumnRange drawn = options.columns.within(eye.width);
    return {drawn.first * pixel, (drawn.end - drawn.first) * pixel, eye.height};
}

// Sends a message of any size. Both sides state the same number of bytes, and cut them alike.
void wireSend(const void* data, size_t bytes, int rank, int tag);
// Waits without keeping a core busy for long: MPI's own waiting does.
void wireReceive(void* data, size_t bytes, int rank, int tag);

} // namespace gsc
