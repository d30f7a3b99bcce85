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

// First bytes of a .gsc file. As in PNG's, the high bit, CR LF, ^Z and LF show a transfer that changed bytes.
constexpr unsigned char kMagic[8] = {0x89, 'G', 'S', 'C', 0x0d, 0x0a, 0x1a, 0x0a};
constexpr uint16_t kVersionMajor = 1; // raised when an old reader must refuse the file
constexpr uint16_t kVersionMinor = 1; // raised for changes that an old reader may ignore
// every section begins at a multiple of so many bytes, and can be mapped or pinned by itself
constexpr uint64_t kSectionAlign = 4096;
constexpr uint64_t kPayloadAlign = 256; // bytes; every chunk payload in ANCH begins at a multiple
constexpr uint64_t kArrayAlign = 64;    // bytes; every array in a chunk payload begins at a multiple
constexpr uint32_t kGroupSize = 128;    // anchors per group; only the last group of a chunk may be shorter
constexpr uint32_t kLeafLog2 = 3;       // a leaf has 8^3 cells, as in the OpenVDB 5-4-3 tree
constexpr uint32_t kChunkLog2 = 3 + 4;  // a chunk, a lower node of that tree, spans 16^3 leaves = 128^3 cells
// largest LevelRecord::cell_log2: a chunk spans at most 2^16 quanta, so that coordinates in it fit 16 bits
constexpr uint32_t kMaxCellLog2 = 9;
constexpr uint32_t kMaxSections = 64;
constexpr uint32_t kMaxLevels = 64;
constexpr uint32_t kMaxFeatDim = 1024;
constexpr uint32_t kMaxOffsets = 256;
constexpr uint32_t kMaxAppearanceDim = 4096;
constexpr uint32_t kMaxFork = 1024;
constexpr int32_t kMaxLevelValue = 1024;      // largest value of |LevelRecord::level| and of level_clamp
constexpr uint64_t kMaxAnchors = 0xfffffffeu; // every anchor number and every count of anchors then fits 32 bits

constexpr uint32_t fourCc(const char (&text)[5])
{
    return uint32_t(uint8_t(text[0])) | uint32_t(uint8_t(text[1])) << 8 | uint32_t(uint8_t(text[2])) << 16 |
           uint32_t(uint8_t(text[3])) << 24;
}

// Sections of version 1, none of which may occur twice. EMBD, CAMS, SENS and TILE may be absent, no other may. SENS
// came with version 1.1, TILE after that.
constexpr uint32_t kSectionMeta = fourCc("META");   // content: UTF-8 JSON manifest, schemas/manifest.schema.json
constexpr uint32_t kSectionParams = fourCc("PARM"); // content: one ModelParams
constexpr uint32_t kSectionLevels = fourCc("LEVL"); // content: ModelParams::level_count LevelRecords
constexpr uint32_t kSectionChunks = fourCc("CHNK"); // content: ModelParams::chunk_count ChunkRecords
constexpr uint32_t kSectionGroups = fourCc("GRUP"); // content: ModelParams::group_count GroupRecords
constexpr uint32_t kSectionLeaves = fourCc("LEAF"); // content: ModelParams::leaf_count LeafRecords
// content: one NanoVDB grid for each level, see LevelRecord::nanovdb_offset
constexpr uint32_t kSectionNanoVdb = fourCc("NVDB");
constexpr uint32_t kSectionIndex = fourCc("INDX");   // uint32_t x anchor_count: number of the anchor per source index
constexpr uint32_t kSectionWeights = fourCc("MLPW"); // content: MlpRecords, then the float weights as trained
// content: a PackedMlpHeader, then weights in the form that devices read
constexpr uint32_t kSectionPacked = fourCc("MLPP");
// content: uint32_t source_row x rows (padded to 64 bytes), then float[A] x rows
constexpr uint32_t kSectionEmbedding = fourCc("EMBD");
// CameraRecord x n, then the names of the cameras (UTF-8, no terminator)
constexpr uint32_t kSectionCameras = fourCc("CAMS");
constexpr uint32_t kSectionAnchors = fourCc("ANCH"); // payloads of the chunks, one behind the other
// AnchorSensitivity x anchor_count, marked kSectionOptional
constexpr uint32_t kSectionSensitivity = fourCc("SENS");
constexpr uint32_t kSectionTile = fourCc("TILE"); // TileRecord, then uint32_t x anchor_count; marked kSectionOptional

enum SectionFlags : uint32_t {
    kSectionOptional = 1u << 0, // flag: a reader that does not know the section may skip it
};

struct FileHeader {
    unsigned char magic[8]; // byte 0: kMagic, by which a .gsc file is recognised
    uint16_t version_major; // byte 8: kVersionMajor of the program that wrote the file
    uint16_t version_minor; // byte 10: kVersionMinor of the program that wrote the file
    uint32_t header_bytes;  // byte 12: size of this header, sizeof(FileHeader)
    uint64_t file_bytes;    // byte 16: size of the whole file, so a truncation shows at once; multiple of kSectionAlign
    uint32_t section_count; // byte 24: number of sections, 1..kMaxSections
    uint32_t section_entry_bytes; // byte 28: size of an entry in the section table, sizeof(SectionEntry)
    uint64_t section_offset;      // byte 32: place of the section table in the file, equals header_bytes
    uint64_t anchor_count;        // byte 40: number of anchors in the file
    uint64_t source_hash;         // byte 48: XXH3-64 of the source PLY and weight files, in the order they were read
    uint64_t config_hash;         // byte 56: XXH3-64 of the effective bake options, as JSON in META
    uint8_t profile;              // byte 64: a value of Profile
    uint8_t reserved0[7];         // byte 65: zero
    uint64_t reserved[6];         // byte 72: zero
    uint64_t header_checksum;     // byte 120: XXH3-64 of header (this field zero) followed by the section table
};
static_assert(sizeof(FileHeader) == 128 && alignof(FileHeader) == 8);
static_assert(offsetof(FileHeader, file_bytes) == 16 && offsetof(FileHeader, profile) == 64);
static_assert(offsetof(FileHeader, header_checksum) == 120);
static_assert(std::is_trivially_copyable_v<FileHeader> && std::is_standard_layout_v<FileHeader>);

enum class Profile : uint8_t {
    Runtime = 0, // a file with the layout of this header
    Archive = 1, // stands for a Runtime file, see archive_layout.h
};

struct SectionEntry {
    uint32_t type;     // byte 0: the section's name, fourCc()
    uint16_t version;  // byte 4: version of the section's own layout, 1
    uint16_t codec;    // byte 6: 0 = not encoded, the only value
    uint32_t flags;    // byte 8: bits of SectionFlags, unknown bits zero
    uint32_t reserved; // byte 12: zero
    uint64_t offset;   // byte 16: place in the file, multiple of kSectionAlign
    uint64_t bytes;    // byte 24: size of the content
    // byte 32: XXH3-64 of the content; for ANCH of the array of ChunkRecord::checksum in chunk order
    uint64_t checksum;
    // byte 40: number of records: of ANCH anchors, of EMBD rows, of NVDB grids; META 0, PARM and MLPP 1
    uint64_t count;
};
static_assert(sizeof(SectionEntry) == 48 && offsetof(SectionEntry, checksum) == 32);
static_assert(std::is_trivially_copyable_v<SectionEntry> && std::is_standard_layout_v<SectionEntry>);

enum class ModelFamily : uint32_t { ScaffoldGs = 0, ScaffoldGsV1 = 1, OctreeGs = 2, OctreeAnyGs = 3 };
enum class LevelRule : uint32_t { None = 0, Floor = 1, Round = 2, Ceil = 3, Progressive = 4 };
enum class RasterRules : uint32_t {
    DiffGaussian = 0, // rules of the rasteriser that Scaffold-GS and Octree-GS bring with them
    Gsplat = 1,       // rules of the gsplat 1.x fork that Octree-AnyGS installs
};
enum class PositionEncoding : uint32_t {
    Grid = 0,  // GridPosition x n; gridCoordinate() gives the trainer's floats bit for bit
    Float = 1, // float[3] x n, because the checkpoint's positions do not fit its grid
};

enum ModelFlags : uint32_t {
    kModelHasLevels = 1u << 0, // anchors have a level and an extra_level, and levels are selected by distance
    // the distance for the selection of levels is that of the anchor plus half a cell (Octree-GS)
    kModelLodHalfCell = 1u << 1,
    // features pass through the feature bank, a network that mixes them by distance and direction
    kModelFeatureBank = 1u << 2,
    // input of the feature bank is [u, d], direction and distance (Scaffold-GS), instead of [u]
    kModelBankDistance = 1u << 3,
    // input of the feature bank is [u, level], direction and level (Octree-GS with add_level)
    kModelBankLevel = 1u << 4,
    kModelWhiteBackground = 1u << 5,
    // ChunkArray::Rotation is present; without the flag every anchor has constant_rotation
    kModelHasRotation = 1u << 6,
    // ChunkArray::Opacity is present; without the flag every anchor has constant_opacity (never used to render)
    kModelHasOpacity = 1u << 7,
    // ChunkArray::Normal is present; without the flag normals are zero (never used to render)
    kModelHasNormal = 1u << 8,
    // Some slots are masked: their offsets are kMaskedOffset, and they are never drawn, whatever the networks say.
    // Added after version 1.1; an older reader refuses the flag.
    kModelMaskedSlots = 1u << 9,
    // Features and offsets of each anchor are small whole numbers times a power of two (format/numbers/compact.h), so
    // that a GPU can hold them in half of the bytes. Added after kModelMaskedSlots; an older reader refuses the flag.
    kModelCompact = 1u << 10,
};

constexpr uint32_t kMaskedOffset = 0x7fc00000u; // bits of each coordinate of a masked slot's offset: a quiet NaN

// Parameters of the trained model that the runtime needs. 256 bytes.
struct ModelParams {
    uint32_t family;          // byte 0: a value of ModelFamily
    uint32_t flags;           // byte 4: bits of ModelFlags
    uint32_t feat_dim;        // byte 8: F, features of an anchor, 1..1024; also the hidden width of the networks
    uint32_t n_offsets;       // byte 12: K, Gaussians of an anchor, 1..256
    uint32_t appearance_dim;  // byte 16: A, columns of EMBD; 0 = no appearance embedding
    uint32_t appearance_rows; // byte 20: number of rows in EMBD
    uint32_t level_rule;      // byte 24: a value of LevelRule
    // byte 28: cells of a level along an axis in a cell of the next coarser level, 2 in the trainers' models
    uint32_t fork;
    int32_t level_min;   // byte 32: smallest level that anchors have
    int32_t level_clamp; // byte 36: M, the largest level that is selected: levels are clamped to [0, M]
    float standard_dist; // byte 40: distance in the rule of levels at which level 0 is wanted, world units
    // byte 44: width of a cell of level 0, world units, for the rule of levels and grid positions; 0 = unknown
    float voxel_size;
    float grid_origin; // byte 48: corner of the grid, equal on all axes, the trainers' init_pos; 0 for Scaffold-GS
    uint32_t position_encoding; // byte 52: a value of PositionEncoding
    uint32_t raster_rules;      // byte 56: a value of RasterRules
    uint32_t level_count;       // byte 60: number of LevelRecords
    // byte 64: quaternion w, x, y, z as in the checkpoint, not normalised; see kModelHasRotation
    float constant_rotation[4];
    float constant_opacity; // byte 80: opacity of every anchor, see kModelHasOpacity
    float near_z;           // byte 84: depth before which nothing is drawn, world units; 0.2, or 0.01 with gsplat
    uint32_t mlp_count;     // byte 88: number of networks, 3, or 4 with a feature bank
    uint32_t chunk_payload_version; // byte 92: version of the layout of payloads, 1
    uint64_t chunk_count;           // byte 96: number of chunks in the file
    uint64_t group_count;           // byte 104: number of groups in the file
    uint64_t leaf_count;            // byte 112: number of leaves in the file
    float bounds_min[3];            // byte 120: lower corner of the box round all anchors, world units
    float bounds_max[3];            // byte 132: upper corner of the box round all anchors, world units
    uint32_t max_chunk_anchors;     // byte 144: anchors of the largest chunk
    uint32_t reserved0;             // byte 148: zero
    uint64_t max_chunk_bytes;       // byte 152: bytes of the largest payload
    float lod_scale;                // byte 160: resolution_scale in the rule of levels, 1 in the trainers' models
    uint32_t reserved[23];          // byte 164: zero
};
static_assert(sizeof(ModelParams) == 256 && alignof(ModelParams) == 8);
static_assert(offsetof(ModelParams, constant_rotation) == 64 && offsetof(ModelParams, chunk_count) == 96);
static_assert(offsetof(ModelParams, max_chunk_bytes) == 152 && offsetof(ModelParams, lod_scale) == 160);
static_assert(std::is_trivially_copyable_v<ModelParams> && std::is_standard_layout_v<ModelParams>);

// One level of detail of the model, which is one grid. 128 bytes.
struct LevelRecord {
    int32_t level;      // byte 0: number of the level, as in the checkpoint
    uint32_t cell_log2; // byte 4: a cell of this level is 2^cell_log2 quanta wide, 0..kMaxCellLog2
    // byte 8: v_L = fl32(voxel_size / fork^level), world units; width of a cell / 2^cell_log2 if positions are Float
    float quantum;
    float origin;            // byte 12: equals ModelParams::grid_origin
    uint64_t anchor_first;   // byte 16: number of the level's first anchor
    uint64_t anchor_count;   // byte 24: number of the level's anchors
    uint64_t chunk_first;    // byte 32: index of the first chunk
    uint64_t chunk_count;    // byte 40: number of the level's chunks
    uint64_t group_first;    // byte 48: index of the first group
    uint64_t group_count;    // byte 56: number of the level's groups
    uint64_t leaf_first;     // byte 64: index of the first leaf
    uint64_t leaf_count;     // byte 72: number of the level's leaves
    uint64_t nanovdb_offset; // byte 80: place of the level's grid in NVDB, multiple of 32
    uint64_t nanovdb_bytes;  // byte 88: bytes of the level's grid in NVDB
    float bounds_min[3];     // byte 96: lower corner of the box round the level's anchors, world units
    float bounds_max[3];     // byte 108: upper corner of the box round the level's anchors, world units
    uint64_t reserved;       // byte 120: zero
};
static_assert(sizeof(LevelRecord) == 128 && offsetof(LevelRecord, anchor_first) == 16);
static_assert(offsetof(LevelRecord, nanovdb_offset) == 80 && offsetof(LevelRecord, bounds_max) == 108);
static_assert(std::is_trivially_copyable_v<LevelRecord> && std::is_standard_layout_v<LevelRecord>);

// One chunk, a lower node of the VDB tree: the unit of I/O, of copies on devices and of checksums. 160 bytes.
struct ChunkRecord {
    uint64_t payload_offset; // byte 0: place of the payload in ANCH, multiple of kPayloadAlign
    uint64_t payload_bytes;  // byte 8: chunkArrayLayout().bytes, without the padding that follows
    uint64_t checksum;       // byte 16: XXH3-64 of the payload_bytes bytes of the payload
    uint32_t level_index;    // byte 24: index of the chunk's level in LEVL
    uint32_t anchor_count;   // byte 28: number of anchors, 1 or more
    uint32_t anchor_first;   // byte 32: number of the first anchor
    uint32_t group_first;    // byte 36: index of the first group
    uint32_t group_count;    // byte 40: number of the chunk's groups
    uint32_t leaf_first;     // byte 44: index of the first leaf
    uint32_t leaf_count;     // byte 48: number of the chunk's leaves
    // byte 52: lower corner of the node, in quanta of the chunk's level; multiple of 128 * 2^cell_log2
    int32_t origin[3];
    float anchor_min[3]; // byte 64: lower corner of the box round the chunk's anchors, world units
    float anchor_max[3]; // byte 76: upper corner of the box round the chunk's anchors, world units
    // byte 88: lower corner of the box round the centres of all Gaussians that the chunk can emit
    float gaussian_min[3];
    // byte 100: upper corner of the box round the centres of all Gaussians that the chunk can emit
    float gaussian_max[3];
    float anchor_sigma_max;   // byte 112: largest exp(scale[0..2]) of the chunk's anchors, world units
    float gaussian_sigma_max; // byte 116: largest exp(scale[3..5]): no Gaussian of the chunk has a larger sigma
    float extra_level_min;    // byte 120: smallest extra_level of the chunk's anchors
    float extra_level_max;    // byte 124: largest extra_level of the chunk's anchors
    float view_sensitivity;   // byte 128: largest AnchorSensitivity::direction of the chunk's anchors, 0 without SENS
    uint32_t reserved[7];     // byte 132: zero
};
static_assert(sizeof(ChunkRecord) == 160 && alignof(ChunkRecord) == 8);
static_assert(offsetof(ChunkRecord, origin) == 52 && offsetof(ChunkRecord, anchor_sigma_max) == 112);
static_assert(std::is_trivially_copyable_v<ChunkRecord> && std::is_standard_layout_v<ChunkRecord>);

// Up to 128 consecutive anchors of one chunk and level: the unit of selection. 80 bytes, five 16-byte loads.
struct GroupRecord {
    float anchor_min[3];      // byte 0: lower corner of the box round the group's anchors, world units
    float anchor_sigma_max;   // byte 12: largest exp(scale[0..2]) of the group's anchors, world units
    float anchor_max[3];      // byte 16: upper corner of the box round the group's anchors
    float gaussian_sigma_max; // byte 28: largest exp(scale[3..5]) of the group's anchors
    // byte 32: lower corner of the box round the centres of all Gaussians that the group can emit
    float gaussian_min[3];
    float extra_level_min; // byte 44: smallest extra_level of the group's anchors
    // byte 48: upper corner of the box round the centres of all Gaussians that the group can emit
    float gaussian_max[3];
    float extra_level_max;  // byte 60: largest extra_level of the group's anchors
    uint32_t anchor_first;  // byte 64: number of the first anchor
    uint32_t chunk;         // byte 68: index of the group's chunk
    uint16_t anchor_count;  // byte 72: number of anchors, 1..kGroupSize
    uint16_t level_index;   // byte 74: index of the group's level in LEVL
    float view_sensitivity; // byte 76: largest AnchorSensitivity::direction of the group's anchors, 0 without SENS
};
static_assert(sizeof(GroupRecord) == 80 && alignof(GroupRecord) == 4);
static_assert(offsetof(GroupRecord, anchor_first) == 64 && offsetof(GroupRecord, view_sensitivity) == 76);
static_assert(std::is_trivially_copyable_v<GroupRecord> && std::is_standard_layout_v<GroupRecord>);

// One leaf of the VDB tree. The records have the order of the anchors, so the leaves of a level follow each other. 24
// bytes.
struct LeafRecord {
    uint32_t anchor_first; // byte 0: number of the first anchor
    uint32_t anchor_count; // byte 4: number of anchors, 1 or more
    int32_t origin[3];     // byte 8: lower corner, in cells of the leaf's level; multiple of 8
    // byte 20: index of the leaf node in the level's NanoVDB grid; each leaf of a level has another
    uint32_t nanovdb_index;
};
static_assert(sizeof(LeafRecord) == 24 && alignof(LeafRecord) == 4);
static_assert(std::is_trivially_copyable_v<LeafRecord> && std::is_standard_layout_v<LeafRecord>);

// Bounds of how much the picture of an anchor changes with the view, in units of full scale (white less black). Half
// floats of zero or more, rounded up; 65504 means that or more. kernels/sensitivity/sensitivity.h defines them. 4
// bytes.
struct AnchorSensitivity {
    uint16_t direction; // byte 0: change per unit of change of the unit view direction
    uint16_t distance;  // byte 2: change per relative change of the distance, 0 if no network takes the distance
};
static_assert(sizeof(AnchorSensitivity) == 4 && std::is_trivially_copyable_v<AnchorSensitivity>);

// Names the whole file from which this file was cut as a tile. Behind it follow, ascending, the source indices that the
// tile's anchors have in the whole file.
struct TileRecord {
    uint64_t whole;         // byte 0: FileHeader::header_checksum of the whole file, which stands for all of its bytes
    uint64_t whole_anchors; // byte 8: anchors of the whole file
};
static_assert(sizeof(TileRecord) == 16 && std::is_trivially_copyable_v<TileRecord>);

enum GridPositionFlags : uint16_t {
    kNegativeZeroX = 1u << 0, // the x coordinate is -0.0f, so that positions equal the source bit for bit
    kNegativeZeroY = 1u << 1,
    kNegativeZeroZ = 1u << 2,
};

// Position of an anchor in quanta of its level, from the origin of its chunk. 8 bytes, one load. Modulo 8 * 2^cell_log2
// it is the position in the leaf.
struct GridPosition {
    uint16_t local[3]; // byte 0: x, y, z in quanta
    uint16_t flags;    // byte 6: GridPositionFlags, unknown bits zero
};
static_assert(sizeof(GridPosition) == 8 && std::is_trivially_copyable_v<GridPosition>);

// One coordinate of an anchor, equal bit for bit to the trainer's: rounded twice, without fused multiply-add.
GSC_HD float gridCoordinate(int32_t quanta, float quantum, float origin, bool negative_zero)
{
#if defined(__CUDA_ARCH__)
    const float value = __fadd_rn(__fmul_rn(float(quanta), quantum), origin);
#else
    // note: not fused with the addition below, since all our host code is compiled with -ffp-contract=off
    const float product = float(quanta) * quantum;
    const float value = product + origin;
#endif
    return negative_zero ? -0.0f : value;
}

// Arrays of a chunk payload, in this order; absent ones take no bytes. n = anchors of the chunk, F and K as in
// ModelParams.
enum class ChunkArray : uint32_t {
    Position = 0,    // GridPosition x n, or float[3] x n (see PositionEncoding)
    SourceIndex = 1, // uint32_t x n: rows of the anchors in the source PLY, not counting rows that were left out
    ExtraLevel = 2,  // float x n: extra_level of the anchors, only with kModelHasLevels
    // float[6] x n: natural logarithms as trained; 0..2: factors of the offsets, 3..5: base size of the Gaussians
    Scale = 3,
    Offset = 4,   // float[K][3] x n; kMaskedOffset for masked slots
    Feature = 5,  // float[F] x n: feature vectors of the anchors
    Rotation = 6, // float[4] x n: quaternions (w, x, y, z) of the anchors, only with kModelHasRotation
    Opacity = 7,  // float x n: opacities stored with the anchors, only with kModelHasOpacity
    Normal = 8,   // float[3] x n: normals of the anchors, only with kModelHasNormal
    Count = 9,
};

struct ChunkArrayLayout {
    uint64_t offset[uint32_t(ChunkArray::Count)]; // byte offset of each array from the start of the payload
    uint64_t stride[uint32_t(ChunkArray::Count)]; // bytes of each array per anchor; 0 = the array is absent
    uint64_t bytes;                               // size of the payload in bytes
};

constexpr uint64_t alignUp(uint64_t value, uint64_t alignment)
{
    return (value + alignment - 1) / alignment * alignment;
}

// Computes the layout of a payload; writer, reader, kernels and validator all call this. Precondition: feat_dim <= 1024
// and n_offsets <= 256, so that nothing wraps around for any 32-bit count.
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
    kMlpTakesFeature = 1u << 0, // input has the anchor's F features, first (every network but the feature bank)
    // input has the distance, behind the 3 values of the view direction that every network takes
    kMlpTakesDistance = 1u << 1,
    kMlpTakesLevel = 1u << 2,      // input has the level, behind the distance
    kMlpTakesAppearance = 1u << 3, // input has the A values of the appearance, last
};

// One network (MLP): Linear(in, hidden) -> ReLU -> Linear(hidden, out) -> activation. 64 bytes. The weights follow all
// records in MLPW, row-major [out][in] as in the checkpoint.
struct MlpRecord {
    uint32_t kind;       // byte 0: a value of MlpKind
    uint32_t activation; // byte 4: a value of Activation
    uint32_t inputs;     // byte 8: bits of MlpInputs
    uint32_t in;         // byte 12: number of inputs
    uint32_t hidden;     // byte 16: width of the hidden layer
    uint32_t out;        // byte 20: number of outputs
    uint64_t weight0;    // byte 24: offset of the first layer's weights in MLPW, multiple of 64
    uint64_t bias0;      // byte 32: offset of the first layer's bias in MLPW, multiple of 64
    uint64_t weight1;    // byte 40: offset of the second layer's weights in MLPW, multiple of 64
    uint64_t bias1;      // byte 48: offset of the second layer's bias in MLPW, multiple of 64
    uint64_t reserved;   // byte 56: zero
};
static_assert(sizeof(MlpRecord) == 64 && offsetof(MlpRecord, weight0) == 24);
static_assert(std::is_trivially_copyable_v<MlpRecord> && std::is_standard_layout_v<MlpRecord>);

// Weights of the three heads in the form that devices read (the feature bank is tiny and stays as in MLPW). 256 bytes.
// Fused first layer: columns = [opacity hidden | covariance hidden | colour hidden], each padded to hidden_pad; rows =
// [F features | 3 direction | 1 distance | 1 level | A appearance], zero where a head does not take the input.
//   first_f32   float[in_rows][3 * hidden_pad], row-major: the transpose of the checkpoint's weights
//   second_f32  per head float[hidden_pad][out_pad], row-major
//   first_f16   B fragments of mma.sync.m16n8k16 (row.col): [k_tile][n_tile][lane 32][4 halves],
//               lane = 4 * column_in_tile + k_pair, halves = rows {2p, 2p+1, 2p+8, 2p+9} of the 16-row k tile.
//               Rows are [F features | 3 direction | distance | level], padded to k_pad; appearance is folded
//               into the bias at load time because one row serves a whole frame
//   second_f16  per head, the same order over [hidden_pad / 16] x [out_pad / 8] tiles
struct PackedMlpHeader {
    uint32_t in_rows;        // byte 0: rows of the fused first layer, F + 3 + 1 + 1 + A
    uint32_t hidden_pad;     // byte 4: width of the hidden layer, rounded up to a multiple of 16
    uint32_t k_pad;          // byte 8: F + 5, rounded up to a multiple of 16
    uint32_t out_pad[3];     // byte 12: outputs of opacity, covariance and colour, each rounded up to a multiple of 16
    uint64_t first_f32;      // byte 24: offset in MLPP of the first layer's float weights, multiple of 256
    uint64_t first_bias_f32; // byte 32: offset in MLPP of the first layer's float[3 * hidden_pad] bias
    uint64_t second_f32[3];  // byte 40: offset of each head's second layer, float weights
    uint64_t second_bias_f32[3]; // byte 64: offset of each head's float[out_pad] bias
    uint64_t first_f16;          // byte 88: offset of the first layer's half weights
    uint64_t second_f16[3];      // byte 96: offset of each head's second layer, half weights
    uint64_t reserved[17];       // byte 120: zero
};
static_assert(sizeof(PackedMlpHeader) == 256 && offsetof(PackedMlpHeader, first_f32) == 24);
static_assert(offsetof(PackedMlpHeader, reserved) == 120);
static_assert(std::is_trivially_copyable_v<PackedMlpHeader> && std::is_standard_layout_v<PackedMlpHeader>);

// A training or test camera with the values of the trainer's cameras.json. 192 bytes.
struct CameraRecord {
    double position[3];    // byte 0: camera centre, world units
    double rotation[9];    // byte 24: rotation, row-major camera-to-world; columns are right, down, forward
    double fx, fy;         // byte 96: focal lengths in pixels, for width x height
    uint32_t width;        // byte 112: width in pixels
    uint32_t height;       // byte 116: height in pixels
    int32_t id;            // byte 120: number of the camera
    int32_t appearance;    // byte 124: row of the trainer's embedding, -1 = none or unknown
    uint32_t name_offset;  // byte 128: place of the name in the table of names behind the records
    uint32_t name_bytes;   // byte 132: bytes of the name
    uint32_t is_test;      // byte 136: 1 = held out for tests, 0 = trained on
    uint32_t reserved[13]; // byte 140: zero
};
static_assert(sizeof(CameraRecord) == 192 && offsetof(CameraRecord, width) == 112);
static_assert(std::is_trivially_copyable_v<CameraRecord> && std::is_standard_layout_v<CameraRecord>);

} // namespace gsc
