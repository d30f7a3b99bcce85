// SPDX-License-Identifier: Apache-2.0
// The .gsc file, version 1. This header is normative together with schemas/gsc.md.
//
//   [FileHeader][SectionEntry x section_count]---[ANCH]---[META]---[PARM]---[LEVL]---...
//
//   ANCH lies first because a converter streams it before it knows the rest; the table says where each section is.
//   "][" = no gap, "---" = zero padding up to kSectionAlign. Little-endian, IEEE-754 binary32.
//   Every byte of the file is the header, the section table, section content (checksummed) or padding (zero).
//
//   ANCH is one payload after another, one per chunk, each aligned to kPayloadAlign. A payload holds the arrays
//   of its anchors, each aligned to kArrayAlign, in the order of ChunkArray (see chunkArrayLayout()).
//
//   Anchors are numbered 0..anchor_count-1 in file order: level, Morton order of leaf, Morton order of cell within
//   the leaf, source index. A chunk (VDB lower node) owns consecutive anchors, a group (128 of them) too, a leaf too.
#pragma once

#include <gsc/hostdev.h>

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace gsc {

// Like PNG's: the high bit, CR LF, ^Z and LF show a transfer that mangled bytes.
constexpr unsigned char kMagic[8] = {0x89, 'G', 'S', 'C', 0x0d, 0x0a, 0x1a, 0x0a};
constexpr uint16_t kVersionMajor = 1;    // bumped when an old reader must refuse the file
constexpr uint16_t kVersionMinor = 1;    // raised for changes that an old reader may ignore
constexpr uint64_t kSectionAlign = 4096; // a section can be mapped or pinned by itself
constexpr uint64_t kPayloadAlign = 256;  // alignment of a chunk payload in ANCH
constexpr uint64_t kArrayAlign = 64;     // alignment of an array in a chunk payload
constexpr uint32_t kGroupSize = 128;     // anchors per group; only the last group of a chunk may be shorter
constexpr uint32_t kLeafLog2 = 3;        // 8^3 cells, the OpenVDB 5-4-3 tree
constexpr uint32_t kChunkLog2 = 3 + 4;   // a lower node spans 16^3 leaves = 128^3 cells
constexpr uint32_t kMaxCellLog2 = 9;     // so that a chunk spans at most 2^16 quanta and locals fit 16 bits
constexpr uint32_t kMaxSections = 64;
constexpr uint32_t kMaxLevels = 64;
constexpr uint32_t kMaxFeatDim = 1024;
constexpr uint32_t kMaxOffsets = 256;
constexpr uint32_t kMaxAppearanceDim = 4096;
constexpr uint32_t kMaxFork = 1024;
constexpr int32_t kMaxLevelValue = 1024;      // |LevelRecord::level| and level_clamp
constexpr uint64_t kMaxAnchors = 0xfffffffeu; // so that every anchor and every count of them fits 32 bits

constexpr uint32_t fourCc(const char (&text)[5])
{
    return uint32_t(uint8_t(text[0])) | uint32_t(uint8_t(text[1])) << 8 | uint32_t(uint8_t(text[2])) << 16 |
           uint32_t(uint8_t(text[3])) << 24;
}

// Sections of version 1. EMBD, CAMS, SENS and TILE may be absent, no other may; none may occur twice. SENS came with 1.1,
// TILE after it.
constexpr uint32_t kSectionMeta = fourCc("META");      // UTF-8 JSON manifest, schemas/manifest.schema.json
constexpr uint32_t kSectionParams = fourCc("PARM");    // ModelParams x 1
constexpr uint32_t kSectionLevels = fourCc("LEVL");    // LevelRecord x level_count
constexpr uint32_t kSectionChunks = fourCc("CHNK");    // ChunkRecord x chunk_count
constexpr uint32_t kSectionGroups = fourCc("GRUP");    // GroupRecord x group_count
constexpr uint32_t kSectionLeaves = fourCc("LEAF");    // LeafRecord x leaf_count
constexpr uint32_t kSectionNanoVdb = fourCc("NVDB");   // one NanoVDB grid per level, see LevelRecord::nanovdb_offset
constexpr uint32_t kSectionIndex = fourCc("INDX");     // uint32_t x anchor_count: source index -> anchor
constexpr uint32_t kSectionWeights = fourCc("MLPW");   // MlpRecord x mlp_count, then canonical fp32 weights
constexpr uint32_t kSectionPacked = fourCc("MLPP");    // PackedMlpHeader, then device-ready weights
constexpr uint32_t kSectionEmbedding = fourCc("EMBD"); // uint32_t source_row x rows (padded to 64 B), float[A] x rows
constexpr uint32_t kSectionCameras = fourCc("CAMS");   // CameraRecord x n, then their names (UTF-8, no terminator)
constexpr uint32_t kSectionAnchors = fourCc("ANCH");   // chunk payloads
// AnchorSensitivity x anchor_count, marked optional
constexpr uint32_t kSectionSensitivity = fourCc("SENS");
constexpr uint32_t kSectionTile = fourCc("TILE"); // TileRecord, then uint32_t x anchor_count; marked optional

enum SectionFlags : uint32_t {
    kSectionOptional = 1u << 0, // a reader that does not know the section may skip it
};

struct FileHeader {
    unsigned char magic[8]; // 0
    uint16_t version_major; // 8
    uint16_t version_minor; // 10
    uint32_t header_bytes;  // 12   sizeof(FileHeader)
    uint64_t file_bytes;    // 16   of the whole file, so that a truncation shows at once; multiple of kSectionAlign
    uint32_t section_count; // 24   1..kMaxSections
    uint32_t section_entry_bytes; // 28 sizeof(SectionEntry)
    uint64_t section_offset;      // 32   of the table: header_bytes
    uint64_t anchor_count;        // 40
    uint64_t source_hash;         // 48   XXH3-64 of the source PLY and weight files, in the order they were read
    uint64_t config_hash;         // 56   XXH3-64 of the effective bake options, as JSON in META
    uint8_t profile;              // 64   Profile
    uint8_t reserved0[7];         // 65   zero
    uint64_t reserved[6];         // 72   zero
    uint64_t header_checksum;     // 120  XXH3-64 of header (this field zero) followed by the section table
};
static_assert(sizeof(FileHeader) == 128 && alignof(FileHeader) == 8);
static_assert(offsetof(FileHeader, file_bytes) == 16 && offsetof(FileHeader, profile) == 64);
static_assert(offsetof(FileHeader, header_checksum) == 120);
static_assert(std::is_trivially_copyable_v<FileHeader> && std::is_standard_layout_v<FileHeader>);

enum class Profile : uint8_t {
    Runtime = 0, // this layout
    Archive = 1, // stands for a file of this layout: archive_layout.h
};

struct SectionEntry {
    uint32_t type;     // 0   fourCc
    uint16_t version;  // 4   of the section's own layout, 1
    uint16_t codec;    // 6   0 = raw
    uint32_t flags;    // 8   SectionFlags, unknown bits zero
    uint32_t reserved; // 12  zero
    uint64_t offset;   // 16  from the start of the file, multiple of kSectionAlign
    uint64_t bytes;    // 24
    uint64_t checksum; // 32  XXH3-64 of the content; for ANCH of the array of ChunkRecord::checksum in chunk order
    uint64_t count;    // 40  records in it: ANCH anchors, EMBD rows, NVDB grids, META 0, PARM and MLPP 1
};
static_assert(sizeof(SectionEntry) == 48 && offsetof(SectionEntry, checksum) == 32);
static_assert(std::is_trivially_copyable_v<SectionEntry> && std::is_standard_layout_v<SectionEntry>);

enum class ModelFamily : uint32_t { ScaffoldGs = 0, ScaffoldGsV1 = 1, OctreeGs = 2, OctreeAnyGs = 3 };
enum class LevelRule : uint32_t { None = 0, Floor = 1, Round = 2, Ceil = 3, Progressive = 4 };
enum class RasterRules : uint32_t {
    DiffGaussian = 0, // the rasteriser vendored by Scaffold-GS and Octree-GS
    Gsplat = 1,       // the gsplat 1.x fork that Octree-AnyGS installs
};
enum class PositionEncoding : uint32_t {
    Grid = 0,  // GridPosition x n; bit-exact through gridPosition()
    Float = 1, // float[3] x n: the checkpoint does not fit its grid
};

enum ModelFlags : uint32_t {
    kModelHasLevels = 1u << 0,    // anchors carry a level and extra_level; LOD selection is on
    kModelLodHalfCell = 1u << 1,  // LOD distance is measured from the anchor plus half a cell (Octree-GS)
    kModelFeatureBank = 1u << 2,  // features pass through the feature bank
    kModelBankDistance = 1u << 3, // bank input is [u, d] (Scaffold-GS) instead of [u]
    kModelBankLevel = 1u << 4,    // bank input is [u, level] (Octree-GS with add_level)
    kModelWhiteBackground = 1u << 5,
    kModelHasRotation = 1u << 6, // ChunkArray::Rotation present; else constant_rotation holds for every anchor
    kModelHasOpacity = 1u << 7,  // ChunkArray::Opacity present; else constant_opacity (never used to render)
    kModelHasNormal = 1u << 8,   // ChunkArray::Normal present; else zero (never used to render)
    // Some slots (Gaussians of an anchor) are masked, their offsets kMaskedOffset: never drawn, whatever the networks say.
    // Came after 1.1; a reader from before refuses the flag
    kModelMaskedSlots = 1u << 9,
    // Features and offsets of an anchor are small whole numbers times a power of two (format/numbers/compact.h), which a GPU holds
    // in half of the bytes. Came after kModelMaskedSlots; a reader from before refuses the flag
    kModelCompact = 1u << 10,
};

constexpr uint32_t kMaskedOffset = 0x7fc00000u; // bits of each coordinate of a masked slot's offset: a quiet NaN

// Hyper-parameters that the runtime needs. 256 bytes.
struct ModelParams {
    uint32_t family;                // 0   ModelFamily
    uint32_t flags;                 // 4   ModelFlags
    uint32_t feat_dim;              // 8   F, 1..1024; also the hidden width
    uint32_t n_offsets;             // 12  K, 1..256
    uint32_t appearance_dim;        // 16  A, columns of EMBD; 0 = none
    uint32_t appearance_rows;       // 20  rows kept in EMBD
    uint32_t level_rule;            // 24  LevelRule
    uint32_t fork;                  // 28  cells per parent cell and axis, 2 upstream
    int32_t level_min;              // 32  smallest level present
    int32_t level_clamp;            // 36  M: the selected level is clamped to [0, M]
    float standard_dist;            // 40  world units
    float voxel_size;               // 44  cell of level 0, world units: LOD rule, grid positions; 0 = unknown
    float grid_origin;              // 48  init_pos, the same on all axes; 0 for Scaffold-GS
    uint32_t position_encoding;     // 52  PositionEncoding
    uint32_t raster_rules;          // 56  RasterRules
    uint32_t level_count;           // 60  LevelRecords
    float constant_rotation[4];     // 64  w, x, y, z as stored upstream, not normalised
    float constant_opacity;         // 80
    float near_z;                   // 84  0.2 upstream, 0.01 for gsplat
    uint32_t mlp_count;             // 88  3, or 4 with a feature bank
    uint32_t chunk_payload_version; // 92  1
    uint64_t chunk_count;           // 96
    uint64_t group_count;           // 104
    uint64_t leaf_count;            // 112
    float bounds_min[3];            // 120 of all anchors, world units
    float bounds_max[3];            // 132
    uint32_t max_chunk_anchors;     // 144
    uint32_t reserved0;             // 148 zero
    uint64_t max_chunk_bytes;       // 152
    float lod_scale;                // 160 resolution_scale of the LOD rule, 1 upstream
    uint32_t reserved[23];          // 164 zero
};
static_assert(sizeof(ModelParams) == 256 && alignof(ModelParams) == 8);
static_assert(offsetof(ModelParams, constant_rotation) == 64 && offsetof(ModelParams, chunk_count) == 96);
static_assert(offsetof(ModelParams, max_chunk_bytes) == 152 && offsetof(ModelParams, lod_scale) == 160);
static_assert(std::is_trivially_copyable_v<ModelParams> && std::is_standard_layout_v<ModelParams>);

// One LOD level = one grid. 128 bytes.
struct LevelRecord {
    int32_t level;           // 0   the value upstream stores
    uint32_t cell_log2;      // 4   a cell is 2^cell_log2 quanta wide, 0..kMaxCellLog2
    float quantum;           // 8   v_L = fl32(voxel_size / fork^level), world units; cell size / 2^cell_log2 if Float
    float origin;            // 12  ModelParams::grid_origin
    uint64_t anchor_first;   // 16
    uint64_t anchor_count;   // 24
    uint64_t chunk_first;    // 32
    uint64_t chunk_count;    // 40
    uint64_t group_first;    // 48
    uint64_t group_count;    // 56
    uint64_t leaf_first;     // 64
    uint64_t leaf_count;     // 72
    uint64_t nanovdb_offset; // 80  in NVDB, multiple of 32
    uint64_t nanovdb_bytes;  // 88
    float bounds_min[3];     // 96  of its anchors
    float bounds_max[3];     // 108
    uint64_t reserved;       // 120 zero
};
static_assert(sizeof(LevelRecord) == 128 && offsetof(LevelRecord, anchor_first) == 16);
static_assert(offsetof(LevelRecord, nanovdb_offset) == 80 && offsetof(LevelRecord, bounds_max) == 108);
static_assert(std::is_trivially_copyable_v<LevelRecord> && std::is_standard_layout_v<LevelRecord>);

// One VDB lower node: the granule of I/O, residency and checksum. 160 bytes.
struct ChunkRecord {
    uint64_t payload_offset;  // 0   from the start of ANCH, multiple of kPayloadAlign
    uint64_t payload_bytes;   // 8   chunkArrayLayout().bytes, without the padding that follows
    uint64_t checksum;        // 16  XXH3-64 of payload_bytes bytes
    uint32_t level_index;     // 24  into LEVL
    uint32_t anchor_count;    // 28  1..
    uint32_t anchor_first;    // 32
    uint32_t group_first;     // 36
    uint32_t group_count;     // 40
    uint32_t leaf_first;      // 44
    uint32_t leaf_count;      // 48
    int32_t origin[3];        // 52  of the node, in quanta of its level; multiple of 128 * 2^cell_log2
    float anchor_min[3];      // 64  bounds of its anchors, world units
    float anchor_max[3];      // 76
    float gaussian_min[3];    // 88  bounds of the centres of every Gaussian its anchors can emit
    float gaussian_max[3];    // 100
    float anchor_sigma_max;   // 112 largest exp(scale_0..2)
    float gaussian_sigma_max; // 116 largest exp(scale_3..5): no Gaussian of the chunk has a larger sigma
    float extra_level_min;    // 120
    float extra_level_max;    // 124
    float view_sensitivity;   // 128 largest AnchorSensitivity::direction of its anchors, 0 without SENS
    uint32_t reserved[7];     // 132 zero
};
static_assert(sizeof(ChunkRecord) == 160 && alignof(ChunkRecord) == 8);
static_assert(offsetof(ChunkRecord, origin) == 52 && offsetof(ChunkRecord, anchor_sigma_max) == 112);
static_assert(std::is_trivially_copyable_v<ChunkRecord> && std::is_standard_layout_v<ChunkRecord>);

// 128 consecutive anchors of one chunk: the cache line of selection, decode and reuse. 80 bytes, five 16-byte loads.
struct GroupRecord {
    float anchor_min[3];      // 0   bounds of its anchors, world units
    float anchor_sigma_max;   // 12  largest exp(scale_0..2)
    float anchor_max[3];      // 16
    float gaussian_sigma_max; // 28  largest exp(scale_3..5)
    float gaussian_min[3];    // 32  bounds of the centres of every Gaussian it can emit
    float extra_level_min;    // 44
    float gaussian_max[3];    // 48
    float extra_level_max;    // 60
    uint32_t anchor_first;    // 64
    uint32_t chunk;           // 68
    uint16_t anchor_count;    // 72  1..kGroupSize
    uint16_t level_index;     // 74
    float view_sensitivity;   // 76  largest AnchorSensitivity::direction of its anchors, 0 without SENS
};
static_assert(sizeof(GroupRecord) == 80 && alignof(GroupRecord) == 4);
static_assert(offsetof(GroupRecord, anchor_first) == 64 && offsetof(GroupRecord, view_sensitivity) == 76);
static_assert(std::is_trivially_copyable_v<GroupRecord> && std::is_standard_layout_v<GroupRecord>);

// One VDB leaf. Order: that of the anchors, so leaf ranges of a level are consecutive. 24 bytes.
struct LeafRecord {
    uint32_t anchor_first;  // 0
    uint32_t anchor_count;  // 4  1..
    int32_t origin[3];      // 8  in cells of its level, multiple of 8
    uint32_t nanovdb_index; // 20 ordinal of the leaf node in the level's NanoVDB grid; those ordinals are a permutation
};
static_assert(sizeof(LeafRecord) == 24 && alignof(LeafRecord) == 4);
static_assert(std::is_trivially_copyable_v<LeafRecord> && std::is_standard_layout_v<LeafRecord>);

// Change of an anchor's picture with the view, in units of full scale; halves of zero or more, rounded up, 65504 = that
// or more. kernels/sensitivity/sensitivity.h defines it. 4 bytes.
struct AnchorSensitivity {
    uint16_t direction; // 0 per unit of change of the unit view direction
    uint16_t distance;  // 2 per relative change of the distance, 0 where no network takes the distance
};
static_assert(sizeof(AnchorSensitivity) == 4 && std::is_trivially_copyable_v<AnchorSensitivity>);

// Names the whole file that this one was cut from. The source indices that its rows have there follow, ascending.
struct TileRecord {
    uint64_t whole;         // 0   FileHeader::header_checksum of the other: it stands for all of its bytes
    uint64_t whole_anchors; // 8
};
static_assert(sizeof(TileRecord) == 16 && std::is_trivially_copyable_v<TileRecord>);

enum GridPositionFlags : uint16_t {
    kNegativeZeroX = 1u << 0, // the coordinate is -0.0f; comparison with the source is bit for bit
    kNegativeZeroY = 1u << 1,
    kNegativeZeroZ = 1u << 2,
};

// Position of an anchor in quanta of its level, relative to its chunk's origin. 8 bytes, one load.
// The leaf-local coordinate of the VDB spine is its value modulo 8 * 2^cell_log2.
struct GridPosition {
    uint16_t local[3]; // 0
    uint16_t flags;    // 6  GridPositionFlags, unknown bits zero
};
static_assert(sizeof(GridPosition) == 8 && std::is_trivially_copyable_v<GridPosition>);

// One coordinate of an anchor, bit for bit as the trainer computed it: two roundings, no fused multiply-add.
GSC_HD float gridCoordinate(int32_t quanta, float quantum, float origin, bool negative_zero)
{
#if defined(__CUDA_ARCH__)
    const float value = __fadd_rn(__fmul_rn(float(quanta), quantum), origin);
#else
    // note: every host target of ours compiles with -ffp-contract=off
    const float product = float(quanta) * quantum;
    const float value = product + origin;
#endif
    return negative_zero ? -0.0f : value;
}

// Arrays of a chunk payload, in this order; absent ones take no bytes. n = anchor_count of the chunk.
enum class ChunkArray : uint32_t {
    Position = 0,    // GridPosition x n, or float[3] x n (PositionEncoding)
    SourceIndex = 1, // uint32_t x n: row of the source PLY, not counting rows that were left out
    ExtraLevel = 2,  // float x n, only with kModelHasLevels
    Scale = 3,       // float[6] x n: natural logs as trained; 0..2 offset extent, 3..5 base scale of the Gaussians
    Offset = 4,      // float[K][3] x n; kMaskedOffset with kModelMaskedSlots
    Feature = 5,     // float[F] x n
    Rotation = 6,    // float[4] x n (w, x, y, z), only with kModelHasRotation
    Opacity = 7,     // float x n, only with kModelHasOpacity
    Normal = 8,      // float[3] x n, only with kModelHasNormal
    Count = 9,
};

struct ChunkArrayLayout {
    uint64_t offset[uint32_t(ChunkArray::Count)]; // from the start of the payload
    uint64_t stride[uint32_t(ChunkArray::Count)]; // bytes per anchor; 0 = absent
    uint64_t bytes;                               // bytes of the payload
};

constexpr uint64_t alignUp(uint64_t value, uint64_t alignment)
{
    return (value + alignment - 1) / alignment * alignment;
}

// The only definition of a payload's layout; writer, reader, kernels and validator call it.
// Precondition: feat_dim <= 1024 and n_offsets <= 256, so nothing wraps for any 32-bit count.
constexpr ChunkArrayLayout chunkArrayLayout(const ModelParams& params, uint32_t anchor_count)
{
    ChunkArrayLayout layout{};
    const uint64_t stride[uint32_t(ChunkArray::Count)] = {
        params.position_encoding == uint32_t(PositionEncoding::Grid) ? sizeof(GridPosition) : 3 * sizeof(float),
        sizeof(uint32_t),
        (params.flags & kModelHasLevels) ? sizeof(float) : 0,
        6 * sizeof(float),
        3 * sizeof(float) * uint64_t(params.n_offsets),
        sizeof(float) * uint64_t(params.feat_dim),
        (params.flags & kModelHasRotation) ? 4 * sizeof(float) : 0,
        (params.flags & kModelHasOpacity) ? sizeof(float) : 0,
        (params.flags & kModelHasNormal) ? 3 * sizeof(float) : 0,
    };
    uint64_t cursor = 0;
    for (uint32_t i = 0; i < uint32_t(ChunkArray::Count); ++i) {
        cursor = alignUp(cursor, kArrayAlign);
        layout.offset[i] = cursor;
        layout.stride[i] = stride[i];
        cursor += stride[i] * anchor_count;
    }
    layout.bytes = cursor;
    return layout;
}

enum class MlpKind : uint32_t { Opacity = 0, Covariance = 1, Color = 2, FeatureBank = 3 };
enum class Activation : uint32_t { None = 0, Tanh = 1, Sigmoid = 2, Softmax = 3 };

enum MlpInputs : uint32_t {
    kMlpTakesFeature = 1u << 0,    // F values, first (all but the feature bank)
    kMlpTakesDistance = 1u << 1,   // after the 3 view-direction values, which every MLP takes
    kMlpTakesLevel = 1u << 2,      // after the distance
    kMlpTakesAppearance = 1u << 3, // A values, last
};

// Linear(in, hidden) -> ReLU -> Linear(hidden, out) -> activation. 64 bytes.
// Canonical weights follow the records in MLPW, row-major [out][in] as upstream stores them.
struct MlpRecord {
    uint32_t kind;       // 0   MlpKind
    uint32_t activation; // 4   Activation
    uint32_t inputs;     // 8   MlpInputs
    uint32_t in;         // 12
    uint32_t hidden;     // 16
    uint32_t out;        // 20
    uint64_t weight0;    // 24  byte offsets from the start of MLPW, multiples of 64
    uint64_t bias0;      // 32
    uint64_t weight1;    // 40
    uint64_t bias1;      // 48
    uint64_t reserved;   // 56  zero
};
static_assert(sizeof(MlpRecord) == 64 && offsetof(MlpRecord, weight0) == 24);
static_assert(std::is_trivially_copyable_v<MlpRecord> && std::is_standard_layout_v<MlpRecord>);

// Device-ready weights of the three heads (the feature bank stays canonical: it is tiny). 256 bytes.
// Fused first layer: columns = [opacity hidden | covariance hidden | colour hidden], each padded to hidden_pad;
// rows = [F features | 3 direction | 1 distance | 1 level | A appearance], zero where a head does not take the input.
//   first_f32   float[in_rows][3 * hidden_pad], row-major: the transpose of upstream's weights
//   second_f32  per head float[hidden_pad][out_pad], row-major
//   first_f16   B fragments of mma.sync.m16n8k16 (row.col): [k_tile][n_tile][lane 32][4 halves],
//               lane = 4 * column_in_tile + k_pair, halves = rows {2p, 2p+1, 2p+8, 2p+9} of the 16-row k tile.
//               Rows are [F features | 3 direction | distance | level], padded to k_pad; appearance is folded
//               into the bias at load time because one row serves a whole frame
//   second_f16  per head, the same order over [hidden_pad / 16] x [out_pad / 8] tiles
struct PackedMlpHeader {
    uint32_t in_rows;            // 0   F + 3 + 1 + 1 + A
    uint32_t hidden_pad;         // 4   hidden rounded up to 16
    uint32_t k_pad;              // 8   F + 5 rounded up to 16
    uint32_t out_pad[3];         // 12  out rounded up to 16: opacity, covariance, colour
    uint64_t first_f32;          // 24  byte offsets from the start of MLPP, multiples of 256
    uint64_t first_bias_f32;     // 32  float[3 * hidden_pad]
    uint64_t second_f32[3];      // 40
    uint64_t second_bias_f32[3]; // 64  float[out_pad]
    uint64_t first_f16;          // 88
    uint64_t second_f16[3];      // 96
    uint64_t reserved[17];       // 120 zero
};
static_assert(sizeof(PackedMlpHeader) == 256 && offsetof(PackedMlpHeader, first_f32) == 24);
static_assert(offsetof(PackedMlpHeader, reserved) == 120);
static_assert(std::is_trivially_copyable_v<PackedMlpHeader> && std::is_standard_layout_v<PackedMlpHeader>);

// A training or test camera as upstream's cameras.json lists it. 192 bytes.
struct CameraRecord {
    double position[3];    // 0   camera centre, world units
    double rotation[9];    // 24  row-major camera-to-world; columns are right, down, forward
    double fx, fy;         // 96  pixels, for width x height
    uint32_t width;        // 112
    uint32_t height;       // 116
    int32_t id;            // 120
    int32_t appearance;    // 124 embedding row, -1 = none or unknown
    uint32_t name_offset;  // 128 in the name table that follows the records
    uint32_t name_bytes;   // 132
    uint32_t is_test;      // 136 1 = held out, 0 = trained on
    uint32_t reserved[13]; // 140 zero
};
static_assert(sizeof(CameraRecord) == 192 && offsetof(CameraRecord, width) == 112);
static_assert(std::is_trivially_copyable_v<CameraRecord> && std::is_standard_layout_v<CameraRecord>);

} // namespace gsc
