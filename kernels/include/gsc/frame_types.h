// SPDX-License-Identifier: Apache-2.0
// Plain data that the stages of a frame pass on to each other. Included by C++ and CUDA alike.
#pragma once

#include <gsc/gsc_layout.h>
#include <gsc/hostdev.h>

#include <cstddef>
#include <cstdint>

namespace gsc {

constexpr uint32_t kMaxEyes = 2;
// width and height of a tile in pixels; part of the image, since every Gaussian covers the whole of a tile it touches
constexpr uint32_t kTileSize = 16;
constexpr uint32_t kColumnStep = 32; // bands of an image begin and end at multiples of so many pixels

// Columns of an image, from `first` up to but not including `end`, counted from the left; both are multiples of
// kColumnStep. `end` may lie beyond the image; {0, 0} means all columns.
struct ColumnRange {
    uint32_t first = 0, end = 0;

    [[nodiscard]] GSC_HD constexpr bool all() const { return end == 0; }
    // Returns these columns cut to an image of that width, with {0, 0} replaced by all its columns.
    [[nodiscard]] GSC_HD constexpr ColumnRange within(uint32_t width) const
    {
        return {first, end == 0 || end > width ? width : end};
    }
    GSC_HD constexpr bool operator==(const ColumnRange& other) const
    {
        return first == other.first && end == other.end;
    }
};

// One eye, in COLMAP's axes (x right, y down, z forward). The values are exactly the fp32 numbers that the trainers'
// code gives to its rasteriser.
struct EyeParams {
    float world_to_view[12];   // row-major 3 x 4 matrix [R t]: view = R * world + t
    float full_projection[16]; // row-major 4 x 4 matrix for column vectors: clip = P * W2C * world
    float center[3];           // place of the camera, world units
    // half of the image's width and height at depth 1; if the axis is in the middle, tangents of half the field of view
    float tan_fov_x, tan_fov_y;
    float tan_mid_x,
        // how far the middle of the image lies right of and below the axis, at depth 1; 0 in the trainers' cameras
        tan_mid_y;
    float focal_x, focal_y; // focal lengths in pixels: size / (2 tan_fov)
    uint32_t width, height; // size of the picture in pixels
};

// EyeParams in double precision, for the reference with which other results are compared.
struct EyeParams64 {
    double world_to_view[12];
    double full_projection[16];
    double center[3];
    double tan_fov_x, tan_fov_y;
    double tan_mid_x, tan_mid_y;
    double focal_x, focal_y;
    uint32_t width, height;
};

// Pointers into the payload of one chunk in memory (chunkArrayLayout()); null: the array is absent. n = anchors of it.
struct ChunkArrays {
    const GridPosition* grid_position; // n elements; null if positions are stored as floats
    const float* float_position;       // n x 3 values; null if positions are on a grid
    const uint32_t* source_index;      // n source indices
    const float* extra_level;          // n elements; null in a model without levels
    const float* scale;                // n x 6 values: natural logarithms of the anchors' scales
    const float* offset;               // n x K x 3 values: offsets of the slots
    const float* feature;              // n x F values: features of the anchors
    const float* rotation;             // n x 4 values, w x y z; null if all anchors have params->constant_rotation
};

// The model as the stages read it: all arrays lie in the mapped file (CPU) or in the device's copy of it.
struct ModelView {
    const ModelParams* params;
    const LevelRecord* levels; // params->level_count elements
    const ChunkRecord* chunks; // params->chunk_count elements
    const GroupRecord* groups; // params->group_count elements
    const ChunkArrays* arrays; // params->chunk_count elements
    const std::byte* weights;  // content of the section MLPW
    const std::byte* packed;   // content of the section MLPP
    const float* embedding;    // appearance_rows x appearance_dim values; null if the model has no embedding
    // AnchorSensitivity of each anchor as two half floats, in file order; null if the file has none
    const uint16_t* sensitivity = nullptr;
    // Point in the world from which positions and bounds are counted, for eyeParams(); not 0 only in a LocalModel.
    double origin[3] = {};
};

enum class Tier : uint32_t { Exact = 0, Fast = 1 };

// Rule that decides when decoded Gaussians of an earlier frame may be drawn again (design section 5).
enum class ReusePolicy : uint32_t {
    None = 0,  // no reuse: every visible anchor is decoded for every frame and eye
    Depth = 1, // reuse for a number of frames, fewer the more of the view is new: the GS-Cache paper's Algorithm 1
    Error = 2, // reuse as long as the predicted change of colours stays within a bound; only on a CPU
};

// Functions by which ReusePolicy::Depth makes a number of frames from the share of visible anchors that are new.
enum class DepthGuidance : uint32_t { Linear = 0, Exponential = 1, Staged = 2 };

struct ReuseOptions {
    ReusePolicy policy = ReusePolicy::None;
    uint32_t max_depth = 10; // for Depth: frames in which an entry may be drawn after the one that decoded it
    DepthGuidance guidance = DepthGuidance::Linear;
    float bound = 1; // for Error: largest predicted change of an anchor's colours, in units of 1/255
    uint64_t decode_budget =
        0; // most anchors to decode per frame and eye, 0 = no limit; anchors without an entry are always decoded
    uint64_t cache_bytes = 0; // most memory in bytes for decoded Gaussians, 0 = a quarter of the machine's
};

// Viewpoint of the networks when there are two eyes. In both modes each eye finds for itself which anchors it sees, and
// where their Gaussians lie in its image.
enum class StereoMode : uint32_t {
    Exact = 0, // networks look from each eye by itself
    // networks look once for both eyes, from the middle between them, as in the GS-Cache paper; not with
    // ReusePolicy::Error
    Merged = 1,
};

// Meaning of the colours of a picture (kernels/present/false_colour.h). Places, shapes, opacities and depths are equal
// in all views, and so are Gaussians kept for later frames.
enum class FrameView : uint32_t {
    Picture = 0, // the colours of the model
    Level = 1,   // the colour of a Gaussian shows the level of its anchor
    Age = 2,     // a Gaussian's colour shows the frames since its anchor was decoded or its copy made, 0 = this one
    Cost = 3,    // a pixel's colour shows the number of Gaussians evaluated for it; sum: EyeCounts::blend_evaluations
    Detail = 4,  // the colour of a Gaussian shows whether its group is near, kept, stale or made (CoarseCounts)
};
constexpr uint32_t kFrameViews = 5;

constexpr float kMostFoveaPixels = 100;

// Detail that may be left out away from where an eye looks (kernels/math/foveation.h); in tier `fast` on a GPU.
// Elsewhere it has no effect.
struct Foveation {
    // Standard deviation in pixels of the smallest Gaussian that is drawn at 40 degrees from the gaze and beyond;
    // within 12 degrees all are drawn. 0 = all are drawn everywhere.
    float smallest = 0;           // 0 (off) to kMostFoveaPixels
    float gaze[kMaxEyes][2] = {}; // direction of each eye's gaze: right and down at depth 1; 0, 0 = along the axis

    bool operator==(const Foveation&) const = default;
};

constexpr float kMostDetail = 8; // largest FrameOptions::detail in pixels

constexpr uint32_t kLensSquare = 32; // width and height in pixels of a square of a LensShape
// rows of squares that a LensShape describes; all of the picture below them is shown
constexpr uint32_t kLensRows = 128;

// Part of an eye's picture that the lens in front of the eye shows: in each row of squares, the columns of squares from
// `first` up to but not including `end`. Other squares are black and cost no blending; their depths are infinity.
struct LensShape {
    uint8_t first[kLensRows] = {}, end[kLensRows] = {};
    bool masks = false; // false: the lens shows the whole picture

    [[nodiscard]] GSC_HD constexpr bool shows(uint32_t column, uint32_t row) const
    {
        return !masks || row >= kLensRows || (column >= first[row] && column < end[row]);
    }
    bool operator==(const LensShape&) const = default;
};

struct FrameOptions {
    Tier tier = Tier::Fast;
    StereoMode stereo = StereoMode::Exact; // has no effect with one eye
    float background[3] = {0, 0, 0};
    int32_t appearance = -1; // row of EMBD; -1 only if the model has no embedding
    float near_z = 0; // depth before which nothing is drawn, world units; 0 = that of the model (ModelParams::near_z)
    // true as in the trainers' code: if there is no Gaussian at all, the picture is black instead of the background
    bool empty_is_black = true;
    float lod_bias = 0; // added to the predicted level; 0 as in the trainers' code
    float lod_fade = 0; // range of levels, 0 to 1, over which an anchor fades in; 0 = it appears at once, as trained
    // levels, 0 to 1, by which a switch may lag behind the camera; 0 as in the trainers' code: not at all
    float lod_hysteresis = 0;
    ReuseOptions reuse;
    FrameView view = FrameView::Picture;
    Foveation foveation;
    // Size in pixels, 0 to kMostDetail, of the smallest detail that is drawn by itself; 0 = everything is drawn. Far
    // groups of anchors are drawn from coarse copies, kept from frame to frame (kernels/coarse/README.md). Not with
    // `reuse`, nor in the tier `exact` on a GPU. On a CPU ReuseOptions::cache_bytes bounds the memory of copies.
    float detail = 0;
    // Columns of every eye that are drawn. Targets are those of the whole image; other columns of them are not written.
    // Only anchors that the columns can show are selected, decoded and counted. Pixels and depths equal those of the
    // whole image: in `exact` to the last byte, in `fast` with the exceptions of bands in kernels/README.md. With reuse
    // each renderer keeps entries of its own, so that pixels are only within the bound that was asked for.
    // empty_is_black has no effect, because a band without Gaussians may lie beside one with some: the background is
    // drawn. If gaussians_visible is 0 in all bands of an eye, and black is wanted then, the caller draws it again as a
    // whole.
    ColumnRange columns;
    LensShape lens[kMaxEyes];
};

// Counts of one eye on which the cost of a frame depends (design section 4).
struct EyeCounts {
    uint64_t groups_tested = 0;   // groups of the chunks whose bounds the eye may see
    uint64_t anchors_tested = 0;  // anchors that were tested one by one
    uint64_t anchors_visible = 0; // anchors that the trainers' rules call visible
    // anchors decoded for this eye; with reuse also neighbours that are not visible; those decoded for both eyes at
    // once count for the first
    uint64_t anchors_decoded = 0;
    uint64_t anchors_reused = 0;
    uint64_t anchors_overdue = 0;   // anchors reused because of the budget, though the policy wanted them decoded
    uint64_t gaussians_alive = 0;   // Gaussians with an opacity of 1/255 or more
    uint64_t gaussians_visible = 0; // Gaussians that reach the screen
    // Gaussians dropped because they are not finite; for these the trainers' code has no defined result
    uint64_t gaussians_dropped = 0;
    uint64_t pairs = 0;             // (tile, splat) pairs; those of tiles that both eyes share count for the first eye
    uint64_t blend_evaluations = 0; // (pixel, splat) pairs that were evaluated

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

// Milliseconds of the stages, for all eyes together, by the device's own clock (on a CPU: wall clock). total: from when
// the device begins the frame until its pictures are ready. On a GPU it also has the start of the graph, if no other
// frame is under way, and the copy of the counters: some 12 us on an H200.
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

// Groups of anchors that a frame with FrameOptions::detail draws. Each counts once; if bands or eyes are drawn apart,
// once in each.
struct CoarseCounts {
    uint64_t near = 0;  // groups decoded for this frame, as all are without detail
    uint64_t kept = 0;  // groups drawn from a coarse copy that is within its bound
    uint64_t stale = 0; // groups drawn from a coarse copy beyond its bound, which waits to be made anew
    uint64_t made = 0;  // groups drawn from a coarse copy that this frame has made

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
    StageTimes times;             // times of the stages, added up over all tries
    uint64_t bytes_resident = 0;  // bytes of memory on the device: model, working buffers and the driver's context
    uint32_t repeats = 0;         // number of times that the frame was drawn again because a buffer was too small
    double repeat_ms = 0;         // part of times.total that tries before the last took
    uint64_t cache_bytes = 0;     // bytes of decoded Gaussians, part of bytes_resident
    uint64_t cache_evictions = 0; // entries that this frame removed from the cache to make room
    uint32_t passes = 1;          // number of passes from near to far; more than one if the memory of a device is short
    // anchors of the model that are not on the device yet (RendererOptions::first_picture)
    uint64_t anchors_absent = 0;
};

} // namespace gsc
