// SPDX-License-Identifier: Apache-2.0
// Plain data that the stages of a frame pass on. Included by C++ and CUDA alike.
#pragma once

#include <gsc/gsc_layout.h>
#include <gsc/hostdev.h>

#include <cstddef>
#include <cstdint>

namespace gsc {

constexpr uint32_t kMaxEyes = 2;
constexpr uint32_t kTileSize = 16;   // part of the image: every Gaussian reaches the whole of each tile it touches
constexpr uint32_t kColumnStep = 32; // bands of an image begin and end at multiples of it

// Columns of an image, from `first` up to but not including `end`, from the left; both are multiples of kColumnStep. end
// may lie beyond the image, and {0, 0} is all of it.
struct ColumnRange {
    uint32_t first = 0, end = 0;

    [[nodiscard]] GSC_HD constexpr bool all() const { return end == 0; }
    // The columns that an image has, none left open.
    [[nodiscard]] GSC_HD constexpr ColumnRange within(uint32_t width) const
    {
        return {first, end == 0 || end > width ? width : end};
    }
    GSC_HD constexpr bool operator==(const ColumnRange& other) const
    {
        return first == other.first && end == other.end;
    }
};

// One eye in COLMAP axes (x right, y down, z forward), exactly the fp32 values upstream hands to its rasteriser.
struct EyeParams {
    float world_to_view[12];    // row-major 3 x 4: view = R * world + t
    float full_projection[16];  // row-major 4 x 4, column vectors: clip = P * W2C * world
    float center[3];            // camera centre, world units
    float tan_fov_x, tan_fov_y; // half of the image's extent at depth 1: tangents of half a centred field of view
    float tan_mid_x,
        tan_mid_y;          // right and down of the axis at depth 1 to the image's middle; 0 in the trainers' cameras
    float focal_x, focal_y; // pixels: size / (2 tan_fov)
    uint32_t width, height; // pixels
};

// EyeParams in double precision, for the reference that measures the others.
struct EyeParams64 {
    double world_to_view[12];
    double full_projection[16];
    double center[3];
    double tan_fov_x, tan_fov_y;
    double tan_mid_x, tan_mid_y;
    double focal_x, focal_y;
    uint32_t width, height;
};

// Pointers into one resident chunk payload (chunkArrayLayout()). Null where the array is absent.
struct ChunkArrays {
    const GridPosition* grid_position; // n, or null if positions are floats
    const float* float_position;       // n x 3, or null
    const uint32_t* source_index;      // n
    const float* extra_level;          // n or null
    const float* scale;                // n x 6
    const float* offset;               // n x K x 3
    const float* feature;              // n x F
    const float* rotation;             // n x 4 or null
};

// The model as the stages read it: everything lies in the mapped file (CPU) or in the device's copy of it.
struct ModelView {
    const ModelParams* params;
    const LevelRecord* levels; // params->level_count
    const ChunkRecord* chunks; // params->chunk_count
    const GroupRecord* groups; // params->group_count
    const ChunkArrays* arrays; // params->chunk_count
    const std::byte* weights;  // MLPW section
    const std::byte* packed;   // MLPP section
    const float* embedding;    // appearance_rows x appearance_dim, or null
    // AnchorSensitivity x anchor_count, so two halves per anchor in file order, or null
    const uint16_t* sensitivity = nullptr;
    // Place in the world that positions and bounds are relative to, for eyeParams(). Not 0 only in a LocalModel.
    double origin[3] = {};
};

enum class Tier : uint32_t { Exact = 0, Fast = 1 };

// Rule for when decoded Gaussians of an earlier frame may be drawn again (design section 5).
enum class ReusePolicy : uint32_t {
    None = 0,  // every visible anchor is decoded for every frame and eye
    Depth = 1, // for a number of frames, fewer the more of the view is new: the GS-Cache paper's Algorithm 1
    Error = 2, // again while its predicted change stays within a bound; on a CPU
};

// How ReusePolicy::Depth turns the share of visible anchors that are new into a depth.
enum class DepthGuidance : uint32_t { Linear = 0, Exponential = 1, Staged = 2 };

struct ReuseOptions {
    ReusePolicy policy = ReusePolicy::None;
    uint32_t max_depth = 10; // Depth: frames an entry may be drawn after the one that decoded it
    DepthGuidance guidance = DepthGuidance::Linear;
    float bound = 1; // Error: largest predicted change of an anchor's colours, in 1/255
    uint64_t decode_budget =
        0; // anchors decoded per frame and eye, 0 = no limit; anchors without an entry are decoded all the same
    uint64_t cache_bytes = 0; // most memory of decoded Gaussians, 0 = a quarter of the machine's
};

// Places that the networks look from when there are two eyes. In both modes each eye finds for itself which anchors it
// sees, and where their Gaussians lie in its image.
enum class StereoMode : uint32_t {
    Exact = 0, // networks look from each eye
    // networks look once, from the middle between both eyes: the GS-Cache paper's; not with ReusePolicy::Error
    Merged = 1,
};

// Meaning of the colours of a picture (kernels/present/false_colour.h). Places, shapes, opacities and depths are the
// same in all, and so are Gaussians kept for later frames.
enum class FrameView : uint32_t {
    Picture = 0, // the model itself
    Level = 1,   // colour of a Gaussian: level of its anchor
    Age = 2,     // colour of a Gaussian: frames since its anchor was decoded or its coarse copy made, 0 = in this one
    Cost = 3,    // colour of a pixel: Gaussians evaluated for it, whose sum is EyeCounts::blend_evaluations
    Detail = 4,  // colour of a Gaussian: whether its group of anchors is near, kept, stale or made (CoarseCounts)
};
constexpr uint32_t kFrameViews = 5;

constexpr float kMostFoveaPixels = 100;

// Detail that may be left out away from where an eye looks (kernels/math/foveation.h), in tier `fast` on a GPU; others
// draw everything.
struct Foveation {
    // Standard deviation, pixels, of the finest Gaussian at 40 degrees and beyond; within 12 degrees everything is drawn.
    // 0 = everywhere.
    float smallest = 0;           // at most kMostFoveaPixels
    float gaze[kMaxEyes][2] = {}; // direction of each eye's gaze, right and down at depth 1; 0, 0 = along its axis

    bool operator==(const Foveation&) const = default;
};

constexpr float kMostDetail = 8; // pixels

constexpr uint32_t kLensSquare = 32; // pixels, each side
constexpr uint32_t kLensRows = 128;  // rows of squares that a LensShape tells about; the picture below them is shown

// Part of an eye's picture that the lens in front of the eye shows: of each row of squares, columns from `first` up to
// but not including `end`, in squares. Other squares are black and cost no blending; their depths are infinity.
struct LensShape {
    uint8_t first[kLensRows] = {}, end[kLensRows] = {};
    bool masks = false; // false: everything is seen

    [[nodiscard]] GSC_HD constexpr bool shows(uint32_t column, uint32_t row) const
    {
        return !masks || row >= kLensRows || (column >= first[row] && column < end[row]);
    }
    bool operator==(const LensShape&) const = default;
};

struct FrameOptions {
    Tier tier = Tier::Fast;
    StereoMode stereo = StereoMode::Exact; // no difference for one eye
    float background[3] = {0, 0, 0};
    int32_t appearance = -1;    // row of EMBD, -1 only if the model has none
    float near_z = 0;           // 0 = the model's (ModelParams::near_z)
    bool empty_is_black = true; // upstream's quirk: no Gaussian at all gives zeros, not the background
    float lod_bias = 0;         // added to the predicted level; 0 = upstream
    float lod_fade = 0;         // levels over which an anchor fades in, 0 to 1; 0 = upstream: it appears at once
    float lod_hysteresis = 0;   // levels that a switch back and forth may lag behind, 0 to 1; 0 = upstream: not at all
    ReuseOptions reuse;
    FrameView view = FrameView::Picture;
    Foveation foveation;
    // Pixels that the smallest detail drawn by itself takes, 0 to kMostDetail; 0 = everything is drawn. Groups of anchors
    // that are far are drawn from coarse copies, which are kept from frame to frame (kernels/coarse/README.md). Not with
    // `reuse`, nor in the tier `exact` on a GPU. On a CPU ReuseOptions::cache_bytes bounds the memory of copies.
    float detail = 0;
    // Columns of every eye that are drawn. Targets are of the whole image, and their other columns are not touched.
    // Only anchors that the columns can show are selected and decoded, and counted. Pixels and depths are those of the
    // whole image to the last byte in `exact`; in `fast` too, with the exceptions of bands in kernels/README.md. With
    // reuse every renderer keeps entries of its own: then they are within the bound that was asked for. empty_is_black
    // means nothing here, because a band without Gaussians may lie beside one with some: the background is drawn. Where
    // gaussians_visible is 0 in all bands of an eye, and the quirk is wanted, the caller draws the eye again as a
    // whole.
    ColumnRange columns;
    LensShape lens[kMaxEyes];
};

// The numbers that carry the cost of a frame (design section 4), per eye.
struct EyeCounts {
    uint64_t groups_tested = 0;   // groups of the chunks whose bounds the eye may see
    uint64_t anchors_tested = 0;  // anchors whose own test ran
    uint64_t anchors_visible = 0; // upstream's visible set
    // for this eye; with reuse also neighbours that are not visible; decoded for both eyes at once, all under the first
    uint64_t anchors_decoded = 0;
    uint64_t anchors_reused = 0;
    uint64_t anchors_overdue = 0;   // reused anchors that the policy wanted decoded, but the budget did not allow
    uint64_t gaussians_alive = 0;   // opacity >= 1/255 after decode
    uint64_t gaussians_visible = 0; // Gaussians on screen after project
    uint64_t gaussians_dropped = 0; // not finite: upstream's behaviour is undefined, ours drops and counts
    uint64_t pairs = 0;             // (tile, splat) pairs; of tiles that both eyes share, all under the first
    uint64_t blend_evaluations = 0; // (pixel, splat) pairs evaluated

    void add(const EyeCounts& other)
    {
        groups_tested += other.groups_tested;
        anchors_tested += other.anchors_tested;
        anchors_visible += other.anchors_visible;
        anchors_decoded += other.anchors_decoded;
        anchors_reused += other.anchors_reused;
        anchors_overdue += other.anchors_overdue;
        gaussians_alive += other.gaussians_alive;
        gaussians_visible += other.gaussians_visible;
        gaussians_dropped += other.gaussians_dropped;
        pairs += other.pairs;
        blend_evaluations += other.blend_evaluations;
    }
};

// Milliseconds by the device's own clock (a CPU's: wall clock), all eyes together. total: from when the device comes to
// the frame until its pictures are ready. Beside the stages a GPU's has the start of their graph, which a device without
// another frame waits for, and the copy of what they counted: some 12 us on an H200.
struct StageTimes {
    double select = 0, decode = 0, project = 0, bin = 0, sort = 0, blend = 0, total = 0;

    void add(const StageTimes& other)
    {
        select += other.select;
        decode += other.decode;
        project += other.project;
        bin += other.bin;
        sort += other.sort;
        blend += other.blend;
        total += other.total;
    }
};

// Groups of anchors that a frame with FrameOptions::detail draws, each once; of bands and eyes drawn apart, once in each.
struct CoarseCounts {
    uint64_t near = 0;  // groups decoded for this frame, as without detail
    uint64_t kept = 0;  // groups drawn from a coarse copy within its bound
    uint64_t stale = 0; // groups drawn from a copy beyond its bound, which waits to be made anew
    uint64_t made = 0;  // groups drawn from a copy that this frame has made

    void add(const CoarseCounts& other)
    {
        near += other.near;
        kept += other.kept;
        stale += other.stale;
        made += other.made;
    }
};

struct FrameResult {
    EyeCounts eyes[kMaxEyes];
    CoarseCounts coarse;
    StageTimes times;             // times of all tries together
    uint64_t bytes_resident = 0;  // model, buffers, and the driver's context
    uint32_t repeats = 0;         // times that the frame was drawn again because a buffer was too small
    double repeat_ms = 0;         // part of times.total: tries before the last
    uint64_t cache_bytes = 0;     // decoded Gaussians, part of bytes_resident
    uint64_t cache_evictions = 0; // entries given up in this frame for others
    uint32_t passes = 1;          // from near to far; more than one where a device's memory is short
    uint64_t anchors_absent = 0; // anchors of the model that are not on the device yet (RendererOptions::first_picture)
};

} // namespace gsc
