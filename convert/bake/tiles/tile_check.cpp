// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/tiles/tile_check.h"

#include "convert/input/model_names.h"
#include <gsc/error.h>

#include <algorithm>
#include <cstring>

namespace gsc {

namespace {

// Flags that must be equal in all tiles. The others tell which arrays a file has, which may differ.
constexpr uint32_t kSharedFlags =
    ~uint32_t(kModelHasRotation | kModelHasOpacity | kModelHasNormal | kModelMaskedSlots | kModelCompact);

class Check {
public:
    Check(const GscView& a, const std::string& a_name, const GscView& b, const std::string& b_name)
        : m_a(a), m_b(b), m_a_name(a_name), m_b_name(b_name)
    {
    }

    void run() const
    {
        const ModelParams &a = *m_a.params, &b = *m_b.params;
        number("family", a.family, b.family);
        number("feat_dim", a.feat_dim, b.feat_dim);
        number("n_offsets", a.n_offsets, b.n_offsets);
        number("appearance_dim", a.appearance_dim, b.appearance_dim);
        number("flags", a.flags & kSharedFlags, b.flags & kSharedFlags);
        number("level_rule", a.level_rule, b.level_rule);
        number("fork", a.fork, b.fork);
        number("level_clamp", a.level_clamp, b.level_clamp);
        number("standard_dist", double(a.standard_dist), double(b.standard_dist));
        // in a model without levels it only tells how positions are stored
        if (a.flags & kModelHasLevels)
            number("voxel_size", double(a.voxel_size), double(b.voxel_size));
        number("raster_rules", a.raster_rules, b.raster_rules);
        number("near_z", double(a.near_z), double(b.near_z));
        number("lod_scale", double(a.lod_scale), double(b.lod_scale));
        number("mlp_count", a.mlp_count, b.mlp_count);
        networks();
        embedding();
    }

private:
    [[noreturn]] void fail(const std::string& field, const std::string& found, const std::string& expected) const
    {
        throw Error(ErrorCode::Difference, m_b_name, formatString("%s is %s", field.c_str(), found.c_str()),
                    formatString("%s as in %s", expected.c_str(), m_a_name.c_str()),
                    "only tiles of one model can be joined, nothing was written");
    }

    void number(const char* field, double a, double b) const
    {
        if (a != b)
            fail(field, formatString("%.9g", b), formatString("%.9g", a));
    }

    void networks() const
    {
        for (size_t i = 0; i < m_a.mlps.size(); ++i) {
            const MlpRecord &a = m_a.mlps[i], &b = m_b.mlps[i];
            const std::string name = std::string("network ") + kMlpNames[a.kind];
            number((name + ": inputs").c_str(), a.inputs, b.inputs);
            number((name + ": width of the input").c_str(), a.in, b.in);
            number((name + ": width of the output").c_str(), a.out, b.out);
            values(name + ": weight of layer 0", a.weight0, b.weight0, uint64_t(a.in) * a.hidden);
            values(name + ": bias of layer 0", a.bias0, b.bias0, a.hidden);
            values(name + ": weight of layer 1", a.weight1, b.weight1, uint64_t(a.hidden) * a.out);
            values(name + ": bias of layer 1", a.bias1, b.bias1, a.out);
        }
    }

    void values(const std::string& field, uint64_t a, uint64_t b, uint64_t count) const
    {
        compare(field, m_a.weights.data() + a, m_b.weights.data() + b, count);
    }

    // Throws if the floats differ in any bit; the message names the first that does.
    void compare(const std::string& field, const std::byte* a, const std::byte* b, uint64_t count) const
    {
        for (uint64_t i = 0; i < count; ++i) {
            float x, y;
            std::memcpy(&x, a + 4 * i, 4);
            std::memcpy(&y, b + 4 * i, 4);
            if (std::memcmp(&x, &y, 4) != 0)
                fail(field + formatString("[%llu]", (unsigned long long)i), formatString("%.9g", double(y)),
                     formatString("%.9g", double(x)));
        }
    }

    void embedding() const
    {
        number("rows of the appearance embedding", double(m_a.embedding_rows.size()),
               double(m_b.embedding_rows.size()));
        for (size_t i = 0; i < m_a.embedding_rows.size(); ++i) {
            const std::string name = formatString("row %zu of the appearance embedding", i);
            number((name + ": number").c_str(), m_a.embedding_rows[i], m_b.embedding_rows[i]);
            const uint64_t columns = m_a.params->appearance_dim;
            compare(name, reinterpret_cast<const std::byte*>(m_a.embedding.data() + i * columns),
                    reinterpret_cast<const std::byte*>(m_b.embedding.data() + i * columns), columns);
        }
    }

    const GscView &m_a, &m_b;
    const std::string &m_a_name, &m_b_name;
};

} // namespace

void checkSameModel(const GscView& first, const std::string& first_name, const GscView& other,
                    const std::string& other_name)
{
    Check(first, first_name, other, other_name).run();
}

} // namespace gsc
