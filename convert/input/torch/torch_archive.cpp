// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/torch_archive.h"

#include "format/numbers/count_text.h"
#include "convert/input/torch/legacy_archive.h"
#include "convert/input/torch/pickle_machine.h"
#include "convert/input/torch/zip_archive.h"
#include <gsc/error.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <set>
#include <string_view>
#include <unordered_map>

static_assert(std::endian::native == std::endian::little, "tensors and PLY rows are copied as they lie");

namespace gsc {

namespace {

// limit of the depth of modules within modules; the trainers' have 2
constexpr size_t kMaxDepth = 16;
constexpr size_t kMaxPath = 512; // most characters of the full name of a tensor or a module
// most dictionary entries visited, because a graph with shared values can take exponential time
constexpr size_t kMaxVisits = 100000;
// Limit of the bytes read from storages, and of the bytes of tensors made, per byte of the archive. The trainers' files
// need 1; files in which several tensors share a storage, or a dimension has stride 0, need a few.
constexpr uint64_t kMostTimes = 16;

// Names of modules that only wrap another one: of DistributedDataParallel and AveragedModel, torch.compile,
// FullyShardedDataParallel, and activation checkpointing.
constexpr std::string_view kWrappers[] = {"module", "_orig_mod", "_fsdp_wrapped_module", "_checkpoint_wrapped_module"};

std::string text(const std::vector<std::byte>& bytes)
{
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Last part of a class name: "Linear" of "__torch__.torch.nn.modules.linear.___torch_mangle_0 Linear".
std::string shortClass(const std::string& global)
{
    return global.substr(global.find_last_of(" .") + 1);
}

// A dotted path without the names of wrappers: "opacity_mlp.module.0.weight" becomes "opacity_mlp.0.weight".
std::string withoutWrappers(std::string_view path)
{
    std::string result;
    for (size_t at = 0; at <= path.size();) {
        const size_t end = std::min(path.find('.', at), path.size());
        const std::string_view part = path.substr(at, end - at);
        if (std::ranges::find(kWrappers, part) == std::end(kWrappers)) {
            result += result.empty() ? "" : ".";
            result += part;
        }
        at = end + 1;
    }
    return result;
}

// Returns the bytes of a tensor's storage, as many as the tensor states. The result may be a view into `scratch`.
using ReadStorage = std::function<std::span<const std::byte>(const PickleTensor&, std::vector<std::byte>& scratch)>;

class Walker {
public:
    Walker(const PickleGraph& graph, const ReadStorage& read, const WantedTensor& wanted, size_t archive_bytes,
           const std::string& name)
        : m_graph(graph), m_read(read), m_wanted(wanted), m_archive_bytes(archive_bytes),
          m_read_left(kMostTimes * archive_bytes), m_made_left(kMostTimes * archive_bytes), m_name(name)
    {
    }

    TorchArchive run()
    {
        const PickleValue& root = m_graph.values[m_graph.root];
        if (root.kind == PickleKind::Object) {
            m_archive.is_script = true;
            m_archive.root_class = shortClass(root.text);
            walkObject(root, "", 0);
        } else if (root.kind == PickleKind::Dict) {
            walkDict(root, "", 0);
        } else {
            throw Error(ErrorCode::Unsupported, m_name, "holds neither a module nor a dictionary",
                        "the MLPs of a saved model",
                        "training checkpoints (chkpnt*.pth) do not hold the anchor features, pass the "
                        "point_cloud/iteration_<n> folder");
        }
        return std::move(m_archive);
    }

private:
    [[noreturn]] void invalid(const std::string& found, const std::string& expected) const
    {
        throw Error(ErrorCode::InvalidFile, m_name, found, expected, "save it again");
    }

    void walkObject(const PickleValue& object, const std::string& path, size_t depth)
    {
        if (object.items.empty())
            return; // an object without a state holds no tensors
        walkDict(m_graph.values[object.items[0]], path, depth);
    }

    void walkDict(const PickleValue& dict, const std::string& path, size_t depth)
    {
        if (depth > kMaxDepth)
            invalid(formatString("modules are nested deeper than %zu levels", kMaxDepth), "2");
        std::set<std::string_view> seen;
        for (size_t i = 0; i + 1 < dict.items.size(); i += 2) {
            if (++m_visits > kMaxVisits)
                invalid(formatString("more than %zu entries", kMaxVisits), "about 20");
            const PickleValue& key = m_graph.values[dict.items[i]];
            if (key.kind != PickleKind::String)
                continue; // keys of the tensors and modules that we need are strings
            // checked before the copy, because one long text can be the key of any number of dictionaries
            if (path.size() + key.text.size() > kMaxPath)
                invalid(formatString("key '%.64s' makes a name of %zu characters", key.text.c_str(),
                                     path.size() + key.text.size()),
                        formatString("at most %zu", kMaxPath));
            if (!seen.insert(key.text).second)
                invalid("key '" + path + key.text + "' occurs twice", "once");
            const PickleValue& value = m_graph.values[dict.items[i + 1]];
            if (value.kind == PickleKind::Tensor) {
                addTensor(m_graph.tensors[size_t(value.integer)], path + key.text);
            } else if (value.kind == PickleKind::Dict) {
                walkDict(value, path + key.text + '.', depth + 1);
            } else if (value.kind == PickleKind::Object) {
                addModule(path + key.text, shortClass(value.text));
                walkObject(value, path + key.text + '.', depth + 1);
            }
        }
    }

    void addModule(const std::string& path, std::string type)
    {
        const std::string_view last = std::string_view(path).substr(path.find_last_of('.') + 1);
        if (std::ranges::find(kWrappers, last) == std::end(kWrappers))
            m_archive.modules.emplace_back(withoutWrappers(path), std::move(type));
    }

    void addTensor(const PickleTensor& source, const std::string& path)
    {
        const std::string name = withoutWrappers(path);
        if (m_wanted && !m_wanted(name))
            return;
        if (const auto [found, is_new] = m_paths.emplace(name, path); !is_new)
            throw Error(ErrorCode::Unsupported, m_name, "holds both '" + found->second + "' and '" + path + "'",
                        "one of them", "save one network only");
        if (source.storage_type != "torch FloatStorage")
            throw Error(ErrorCode::Unsupported, m_name,
                        formatString("tensor '%s' is a %s", path.c_str(), source.storage_type.c_str()),
                        "float32 as the trainers save it", "convert it with .float() and save again");
        const uint64_t count = checkedCount(source, path);
        NamedTensor tensor{name, source.shape, {}};
        if (count != 0) {
            const std::span<const std::byte> bytes = storageOf(source);
            // several tensors may share a storage, and a damaged file may state another size of it in each
            if (source.storage_count > bytes.size() / sizeof(float))
                invalid("tensor '" + path + "' states a storage of more values than '" +
                            source.storage_key.substr(0, 64) + "' has",
                        "as many");
            if (count > m_made_left / sizeof(float))
                refuseSharing();
            m_made_left -= count * sizeof(float);
            tensor.values.resize(count);
            copyValues(source, bytes.data() + source.offset * sizeof(float), tensor.values);
        }
        m_archive.tensors.push_back(std::move(tensor));
    }

    // Number of values of a tensor. Throws if they do not all lie within its storage.
    uint64_t checkedCount(const PickleTensor& source, const std::string& path)
    {
        // note: divided instead of multiplied, because the dimensions come from the file and a product could wrap round
        constexpr uint64_t kMost = ~0ull;
        // `last`: distance in elements from the tensor's first value to the value farthest from it
        uint64_t count = 1, last = 0;
        for (const uint64_t size : source.shape)
            count = size == 0 || count == 0 ? 0 : size > kMost / count ? kMost : count * size;
        for (size_t i = 0; count != 0 && i < source.shape.size(); ++i) {
            const uint64_t steps = source.shape[i] - 1, stride = source.stride[i];
            if (stride != 0 && steps > (source.storage_count - std::min(last, source.storage_count)) / stride)
                last = kMost;
            else if (last != kMost)
                last += steps * stride;
        }
        if (source.offset > source.storage_count ||
            (count != 0 && (source.offset == source.storage_count || last >= source.storage_count - source.offset)))
            invalid("tensor '" + path + "' reaches beyond its storage", "it to fit");
        return count;
    }

    // Bytes of the storage of a tensor. The storage read last is kept, because tensors that share one follow each
    // other.
    std::span<const std::byte> storageOf(const PickleTensor& source)
    {
        if (!m_storage.empty() && m_storage_key == source.storage_key)
            return m_storage;
        if (source.storage_count > m_archive_bytes / sizeof(float))
            invalid("storage '" + source.storage_key.substr(0, 64) +
                        "' states more values than the archive has bytes for",
                    "as many as it holds");
        const uint64_t bytes = source.storage_count * sizeof(float);
        if (bytes > m_read_left)
            refuseSharing();
        m_read_left -= bytes;
        m_storage = m_read(source, m_scratch);
        m_storage_key = source.storage_key;
        return m_storage;
    }

    // Copies the values of a tensor row by row along its last dimension; strides may be any, 0 too, as in torch.load.
    void copyValues(const PickleTensor& source, const std::byte* first, std::vector<float>& values) const
    {
        const size_t dimensions = source.shape.size();
        const uint64_t inner = dimensions == 0 ? 1 : source.shape.back();
        const uint64_t step = dimensions == 0 ? 1 : source.stride.back();
        std::vector<uint64_t> at(dimensions, 0);
        for (uint64_t done = 0; done < values.size(); done += inner) {
            uint64_t offset = 0;
            for (size_t i = 0; i + 1 < dimensions; ++i)
                offset += at[i] * source.stride[i];
            const std::byte* const row = first + offset * sizeof(float);
            if (step == 1)
                std::memcpy(values.data() + done, row, inner * sizeof(float));
            for (uint64_t i = 0; step != 1 && i < inner; ++i)
                std::memcpy(values.data() + done + i, row + i * step * sizeof(float), sizeof(float));
            for (size_t i = dimensions - std::min<size_t>(dimensions, 1); i-- > 0 && ++at[i] == source.shape[i];)
                at[i] = 0;
        }
    }

    // Throws for tensors that share storages too often. The trainers' never do, but a hostile file could have one
    // storage read a million times.
    [[noreturn]] void refuseSharing() const
    {
        throw Error(ErrorCode::Unsupported, m_name, "tensors hold many times the values of the archive",
                    "one storage per tensor", "call .clone() on each and save again");
    }

    const PickleGraph& m_graph;
    const ReadStorage& m_read;
    const WantedTensor& m_wanted;
    uint64_t m_archive_bytes;
    uint64_t m_read_left, m_made_left; // bytes still allowed, see kMostTimes
    const std::string& m_name;
    size_t m_visits = 0;
    std::unordered_map<std::string, std::string> m_paths; // full path in the file of each name without wrappers
    std::string m_storage_key;
    std::span<const std::byte> m_storage;
    std::vector<std::byte> m_scratch;
    TorchArchive m_archive;
};

void checkVersion(const ZipArchive& zip, const std::string& prefix, const std::string& name)
{
    if (zip.contains(prefix + "byteorder")) {
        const std::string order = text(zip.read(prefix + "byteorder"));
        if (order != "little")
            throw Error(ErrorCode::Unsupported, name, "byte order is '" + order.substr(0, 16) + "'", "'little'",
                        "save it again on a little-endian machine");
    }
    if (!zip.contains(prefix + "version"))
        return;
    const std::string version = text(zip.read(prefix + "version"));
    const long number = std::strtol(version.c_str(), nullptr, 10);
    if (number < 1 || number > 10)
        throw Error(ErrorCode::Unsupported, name, formatString("archive version is '%.8s'", version.c_str()), "1 to 10",
                    "save it again with an older PyTorch");
}

TorchArchive readLegacy(std::span<const std::byte> bytes, const std::string& name, const WantedTensor& wanted)
{
    const LegacyArchive archive = openLegacyArchive(bytes, name);
    const ReadStorage read = [&](const PickleTensor& tensor, std::vector<std::byte>&) {
        return archive.storages.at(tensor.storage_key);
    };
    return Walker(archive.graph, read, wanted, bytes.size(), name).run();
}

struct Format {
    size_t at;
    std::string_view bytes;
    const char* name;
};

constexpr Format kOtherFormats[] = {{8, "{\"", "a safetensors file"},
                                    {0, "\x89HDF\r\n", "an HDF5 file"},
                                    {0, "\x93NUMPY", "a NumPy array"},
                                    {0, "ply\n", "a PLY file"},
                                    {257, "ustar", "a tar archive, as PyTorch before 0.1.10 saved it, or another one"}};

// Throws if the file is not from PyTorch; the message names the format that it has.
void refuseOtherFormats(std::span<const std::byte> bytes, const std::string& name)
{
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (text.empty())
        throw Error(ErrorCode::InvalidFile, name, "is empty", "an archive of PyTorch", "copy the file again");
    for (const Format& format : kOtherFormats)
        if (text.size() > format.at && text.substr(format.at).starts_with(format.bytes))
            throw Error(ErrorCode::Unsupported, name, std::string("is ") + format.name,
                        "an archive of torch.save or torch.jit.save",
                        "load it and save the state_dict with torch.save");
}

// Folder in the zip archive that all members lie in, with a slash at its end. It is named after the file when that was
// saved, and stays when the file is renamed.
std::string archiveFolder(const ZipArchive& zip, const std::string& name)
{
    const std::string& first = zip.members().front();
    const size_t slash = first.find('/');
    const std::string prefix = slash == std::string::npos ? "" : first.substr(0, slash + 1);
    if (!zip.contains(prefix + "data.pkl") && !zip.contains(prefix + "version"))
        throw Error(ErrorCode::Unsupported, name, "is a zip archive of '" + first.substr(0, 64) + "' without data.pkl",
                    "an archive of torch.save or torch.jit.save",
                    "unpack it, and pass the file that the trainer saved");
    return prefix;
}

} // namespace

TorchArchive readTorchArchive(std::span<const std::byte> bytes, const std::string& name, const WantedTensor& wanted)
{
    if (isLegacyArchive(bytes))
        return readLegacy(bytes, name, wanted);
    refuseOtherFormats(bytes, name);
    const ZipArchive zip(bytes, name);
    const std::string prefix = archiveFolder(zip, name);
    checkVersion(zip, prefix, name);
    const PickleGraph graph = loadPickle(zip.read(prefix + "data.pkl"), name);
    const ReadStorage read = [&](const PickleTensor& tensor, std::vector<std::byte>& scratch) {
        const std::string member = prefix + "data/" + tensor.storage_key;
        if (const uint64_t size = zip.size(member); size != tensor.storage_count * sizeof(float))
            throw Error(ErrorCode::InvalidFile, name,
                        formatString("member '%s' has %s", member.c_str(), formatCount(size, "byte").c_str()),
                        formatString("%llu float32", static_cast<unsigned long long>(tensor.storage_count)),
                        "save it again");
        scratch = zip.read(member);
        return std::span<const std::byte>(scratch);
    };
    return Walker(graph, read, wanted, zip.contentBytes(), name).run();
}

} // namespace gsc
