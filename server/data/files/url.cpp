#include "server/data/files/url.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <optional>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/files/locate_parts.hpp"

namespace windsplat::data {

namespace {

constexpr std::size_t url_bytes_max = 2048;
constexpr std::uint16_t https_port = 443;
constexpr std::uint16_t http_port = 80;

bool is_alphanumeric(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

bool is_unreserved(char c) {
  return is_alphanumeric(c) || c == '-' || c == '.' || c == '_' || c == '~';
}

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::uint16_t default_port(std::string_view scheme) {
  return scheme == "https" ? https_port : scheme == "http" ? http_port : std::uint16_t{0};
}

Error refused_url(std::string_view url, const std::string& why) {
  return make_error(ErrorKind::invalid, in_quotes(without_secrets(url)) + ' ' + why);
}

// The characters of a segment (RFC 3986, 3.3); upper-case hexadecimal digits.
std::optional<std::string> plain_path(std::string_view path) {
  constexpr std::string_view others = "!$&'()*+,;=:@/";
  std::string out;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (path[i] != '%') {
      if (!is_unreserved(path[i]) && others.find(path[i]) == std::string_view::npos) return {};
      out += path[i];
      continue;
    }
    const bool whole = i + 2 < path.size() && hex_value(path[i + 1]) >= 0 &&
                       hex_value(path[i + 2]) >= 0 && path.substr(i, 3) != "%00";
    if (!whole) return {};
    out += '%';
    for (const char digit : path.substr(i + 1, 2)) {
      out += "0123456789ABCDEF"[hex_value(digit)];
    }
    i += 2;
  }
  return out;
}

// Empty, "." and ".." segments would let one file have several URLs, or leave the folder.
bool has_odd_segment(std::string_view path) {
  for (std::size_t from = 1; from < path.size();) {
    const std::size_t end = std::min(path.find('/', from), path.size());
    const std::string segment = percent_decoded(path.substr(from, end - from));
    const bool is_step = segment.empty() || segment == "." || segment == "..";
    if (is_step || segment.find('/') != std::string::npos) return true;
    from = end + 1;
  }
  return false;
}

// Sets host and port; false if they are malformed.
bool set_authority(std::string_view authority, Url& out) {
  std::string_view port;
  if (authority.starts_with('[')) {
    const std::size_t end = authority.find(']');
    if (end == std::string_view::npos) return false;
    out.host = lower(authority.substr(1, end - 1));
    port = authority.substr(end + 1);
    const bool address =
        !out.host.empty() && std::all_of(out.host.begin(), out.host.end(), [](char c) {
          return hex_value(c) >= 0 || c == ':' || c == '.';
        });
    if (!address) return false;
  } else {
    const std::size_t colon = std::min(authority.find(':'), authority.size());
    out.host = lower(authority.substr(0, colon));
    port = authority.substr(colon);
    const bool name =
        !out.host.empty() && std::all_of(out.host.begin(), out.host.end(), [](char c) {
          return is_alphanumeric(c) || c == '-' || c == '.' || c == '_';
        });
    if (!name) return false;
  }
  out.port = default_port(out.scheme);
  if (port.empty()) return true;
  port.remove_prefix(1);
  const auto [end, fault] = std::from_chars(port.data(), port.data() + port.size(), out.port);
  return fault == std::errc() && end == port.data() + port.size() && out.port > 0 &&
         out.scheme != "s3";
}

// Of a THREDDS server; others are recognised by the scheme dods only.
bool is_service(const Url& url) { return url.path.find("/dodsC/") != std::string::npos; }

// The ending of a URL that is an answer about a dataset of a service, or a page about it; empty if
// it is none. The page of a file is one of a service: x.nc.html.
std::string_view ending_of_answer(std::string_view path, bool service) {
  constexpr auto answers =
      std::to_array<std::string_view>({".dods", ".dds", ".das", ".dmr", ".dap"});
  constexpr auto pages = std::to_array<std::string_view>({".html", ".info", ".ascii", ".asc"});
  constexpr auto files = std::to_array<std::string_view>(
      {".nc", ".nc4", ".cdf", ".h5", ".hdf", ".hdf5", ".grb", ".grb2", ".grib", ".grib2"});
  for (const std::string_view ending : answers) {
    if (path.ends_with(ending)) return ending;
  }
  for (const std::string_view ending : pages) {
    if (!path.ends_with(ending)) continue;
    const std::string_view named = path.substr(0, path.size() - ending.size());
    const bool is_of_file = std::any_of(
        files.begin(), files.end(), [&](std::string_view file) { return named.ends_with(file); });
    if (service || is_of_file) return ending;
  }
  return {};
}

// A page of THREDDS that lists datasets, or describes one.
bool is_catalogue(const Url& url) {
  return url.path.find("/thredds/catalog/") != std::string::npos ||
         url.path.ends_with("/catalog.html") || url.path.ends_with("/catalog.xml");
}

// Names of parameters that sign a URL; their values must not be taken for a selection, which
// messages and ids show.
bool is_signature(const Selection& selection) {
  return std::any_of(selection.begin(), selection.end(), [](const SelectedEntry& entry) {
    const std::string name = lower(entry.dimension);
    return name.starts_with("x-amz-") || name.starts_with("x-goog-") || name == "signature" ||
           name == "sig" || name == "token" || name == "access_token";
  });
}

}  // namespace

std::string Url::text() const {
  const bool is_ipv6 = host.find(':') != std::string::npos;
  std::string out = scheme + "://" + (is_ipv6 ? '[' + host + ']' : host);
  if (port != default_port(scheme)) out += ':' + std::to_string(port);
  return out + path;
}

bool looks_like_url(std::string_view text) { return text.find("://") != std::string_view::npos; }

std::string without_secrets(std::string_view url) {
  std::string out(url.substr(0, url.find('?')));
  const std::size_t begin = out.find("://");
  if (begin == std::string::npos) return out;
  const std::size_t end = std::min(out.find('/', begin + 3), out.size());
  const std::size_t at = out.rfind('@', end);
  if (at != std::string::npos && at > begin) out.erase(begin + 3, at - begin - 2);
  return out;
}

std::string percent_encoded(std::string_view name) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string out;
  for (const char c : name) {
    if (is_unreserved(c) || c == '/') {
      out += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    out += '%';
    out += digits[byte >> 4U];
    out += digits[byte & 15U];
  }
  return out;
}

std::string percent_decoded(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? hex_value(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_value(text[i + 2]) : -1;
    out += low >= 0 ? static_cast<char>(high * 16 + low) : text[i];
    if (low >= 0) i += 2;
  }
  return out;
}

Result<Url> parse_url(std::string_view text) {
  if (text.size() > url_bytes_max) {
    return make_error(ErrorKind::invalid,
                      "a URL has more than " + std::to_string(url_bytes_max) + " bytes");
  }
  Url out;
  const std::size_t mark = text.find("://");
  if (mark == std::string_view::npos) return refused_url(text, "is not a URL");
  out.scheme = lower(text.substr(0, mark));
  if (out.scheme != "https" && out.scheme != "http" && out.scheme != "s3") {
    return refused_url(text,
                       "is a URL of a scheme that is not supported: files are read by https, "
                       "http, s3 and dods (a dataset of an OPeNDAP service)");
  }
  const std::string_view rest = text.substr(mark + 3);
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  const std::string_view authority = rest.substr(0, slash);
  if (authority.find('@') != std::string_view::npos) {
    return refused_url(text, "is given with a user or password, which a URL must not contain");
  }
  if (!set_authority(authority, out))
    return refused_url(text, "is not a URL with a valid host and port");
  auto path = plain_path(slash == rest.size() ? "/" : rest.substr(slash));
  if (!path) return refused_url(text, "has a character that must be percent-encoded in a URL");
  if (has_odd_segment(*path))
    return refused_url(text, "is a URL with an empty segment, '.', '..' or an encoded '/'");
  out.path = std::move(*path);
  return out;
}

Result<Location> locate_url(const std::string& text) {
  Location out;
  out.fetched = true;
  std::string plain = text;
  if (const std::size_t mark = selection_mark(plain); mark != std::string::npos) {
    auto selection = parse_selection(std::string_view(plain).substr(mark + 1));
    if (!selection) {
      return refused_url(text, "has a query that is not a selection (?NAME=VALUE&NAME=VALUE)");
    }
    if (is_signature(*selection)) {
      return refused_url(text,
                         "has a signature or token, which a URL must not contain: queries are not "
                         "sent to the host");
    }
    out.selection = std::move(*selection);
    plain.resize(mark);
  }
  if (plain.find('?') != std::string::npos) {
    return refused_url(text,
                       "has a query; only a selection (?NAME=VALUE) may follow, which is not sent "
                       "to the host");
  }
  if (const auto mark = plain.rfind("#/"); mark != std::string::npos) {
    out.inside = plain.substr(mark + 2);
    plain.resize(mark);
  }
  constexpr std::string_view service_scheme = "dods://";
  if (lower(plain.substr(0, service_scheme.size())) == service_scheme) {
    out.service = true;
    plain = "https://" + plain.substr(service_scheme.size());
  }
  const auto url = parse_url(plain);
  if (!url) return url.error();
  out.service = out.service || is_service(*url);
  if (is_catalogue(*url)) {
    return refused_url(text,
                       "is a page of a catalogue: give the address of a dataset on it, of OPENDAP "
                       "(with /dodsC/, without .html) or HTTPServer (with /fileServer/)");
  }
  if (const auto ending = ending_of_answer(url->path, out.service); !ending.empty()) {
    return refused_url(text,
                       "is a page or an answer of an OPeNDAP service: give the URL without "
                       "this ending (" +
                           std::string(ending) + ')' +
                           (out.service ? "" : ", and as dods://HOST/PATH"));
  }
  const std::string_view path = url->path;
  if (path.find_first_of("*{") != std::string_view::npos) {
    return refused_url(text, "is a pattern; a URL names one file or one Zarr store");
  }
  const bool ends_in_slash = path.ends_with('/');
  const std::string_view named = path.substr(0, path.size() - (ends_in_slash ? 1 : 0));
  const std::size_t last = named.find_last_of('/');
  const std::string name = percent_decoded(named.substr(std::min(last + 1, named.size())));
  const std::string base = url->text().substr(0, url->text().size() - path.size());
  out.stem = std::filesystem::path(name.empty() ? url->host : name).stem().native();
  if (out.service && (ends_in_slash || url->scheme == "s3" || name.empty())) {
    return refused_url(text, "is not a dataset of an OPeNDAP service");
  }
  if (!out.service && (ends_in_slash || lower(name).ends_with(".zarr"))) {
    if (!out.inside.empty())
      return refused_url(text, "names a group, which a folder does not have");
    out.kind = Location::Kind::folder;
    out.folder = base + std::string(named);
    return out;
  }
  if (name.find('/') != std::string::npos)
    return refused_url(text, "is a URL with '/' in the name of a file");
  out.folder = base + std::string(named.substr(0, last));
  out.members.push_back({name, base + std::string(named)});
  out.companions = !out.service && may_have_companions(name);
  return out;
}

}  // namespace windsplat::data
