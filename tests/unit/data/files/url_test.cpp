// URLs of datasets: parts, locations, and refusal of what is ambiguous or secret.
#include "server/data/files/url.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "server/data/files/files.hpp"

namespace windsplat::data {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string canonical(const std::string& text) {
  const auto url = parse_url(text);
  return url ? url->text() : "refused: " + url.error().message;
}

TEST(UrlText, EqualUrlsHaveOneText) {
  EXPECT_EQ(canonical("HTTPS://Data.Example:443/a/B.nc"), "https://data.example/a/B.nc");
  EXPECT_EQ(canonical("http://data.example:80"), "http://data.example/");
  EXPECT_EQ(canonical("http://data.example:8080/x"), "http://data.example:8080/x");
  EXPECT_EQ(canonical("https://[2001:DB8::1]:8443/x"), "https://[2001:db8::1]:8443/x");
  EXPECT_EQ(canonical("https://h/a%3fb%c3%a4"), "https://h/a%3Fb%C3%A4");
  EXPECT_EQ(canonical("s3://bucket/key/x.nc"), "s3://bucket/key/x.nc");
}

TEST(UrlText, WhatIsNotOneUrlOfAFileIsRefused) {
  for (const char* text :
       {"ftp://h/x",         "file:///etc/passwd",   "https:///x",         "https://h:0/x",
        "https://h:65536/x", "https://h:1a/x",       "https://h x/y",      "https://h/a b",
        "https://h/a\nb",    "https://h/%00",        "https://h/%4",       "https://h/%zz",
        "https://h/../x",    "https://h/a/%2e%2E/x", "https://h/b/..%2Fx", "https://h/./x",
        "https://h//x",      "https://h/x#y",        "https://h/\\x",      "https://[::1/x",
        "https://[v1.x]/",   "s3://bucket:80/x",     "https://h/x\xC3\xA4"}) {
    EXPECT_THAT(canonical(text), HasSubstr("refused: ")) << text;
  }
  EXPECT_THAT(canonical("https://h/" + std::string(3000, 'a')), HasSubstr("more than 2048"));
}

TEST(UrlText, SecretsAreNotRepeatedInMessages) {
  for (const char* text :
       {"https://user:hunter2@h/x.nc", "https://h/x.nc?X-Amz-Signature=hunter2&X-Amz-Date=1",
        "https://h/x.nc?sig=hunter2", "https://h/x.nc?hunter2",
        "https://h/x.nc?a=1&hunter2=", "https://a:hunter2@h x/y"}) {
    const auto location = locate_url(text);
    ASSERT_FALSE(location) << text;
    EXPECT_EQ(location.error().kind, ErrorKind::invalid) << text;
    EXPECT_THAT(location.error().message, Not(HasSubstr("hunter2"))) << text;
  }
}

TEST(UrlLocation, FilesAndFoldersAreToldApartByTheirEnding) {
  const auto file = locate("https://h:8443/runs/gcm%20a.nc");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_TRUE(file->fetched);
  EXPECT_EQ(file->kind, Location::Kind::file);
  EXPECT_EQ(file->folder, "https://h:8443/runs");
  ASSERT_EQ(file->members.size(), 1U);
  EXPECT_EQ(file->members[0].name, "gcm a.nc");
  EXPECT_EQ(file->members[0].path, "https://h:8443/runs/gcm%20a.nc");
  EXPECT_EQ(file->stem, "gcm a");
  EXPECT_FALSE(file->companions);
  EXPECT_TRUE(locate_url("https://h/x.nhdr")->companions);
  for (const char* text : {"s3://bucket/runs/gcm.zarr", "s3://bucket/runs/gcm.zarr/"}) {
    const auto folder = locate_url(text);
    ASSERT_TRUE(folder) << folder.error().message;
    EXPECT_EQ(folder->kind, Location::Kind::folder);
    EXPECT_EQ(folder->folder, "s3://bucket/runs/gcm.zarr");
    EXPECT_EQ(folder->stem, "gcm");
  }
  EXPECT_EQ(locate_url("s3://bucket/")->folder, "s3://bucket");
  EXPECT_EQ(locate_url("s3://bucket/")->stem, "bucket");
}

TEST(UrlLocation, GroupAndSelectionFollowAsInPaths) {
  const auto location = locate_url("https://h/x.nc#/forecast/wind?number=3&time=2020-01-01");
  ASSERT_TRUE(location) << location.error().message;
  EXPECT_EQ(location->inside, "forecast/wind");
  EXPECT_EQ(selection_text(location->selection), "number=3,time=2020-01-01");
  EXPECT_EQ(location->members[0].path, "https://h/x.nc");
  EXPECT_FALSE(locate_url("https://h/x.zarr#/group"));
}

TEST(UrlLocation, PatternsAndServicesAreRefusedByName) {
  EXPECT_THAT(locate_url("https://h/wrf_*.nc").error().message, HasSubstr("pattern"));
  EXPECT_THAT(locate_url("https://h/x.nc.dods").error().message, HasSubstr("dods://HOST/PATH"));
  for (const char* page : {"https://h/thredds/dodsC/a/x.nc.html", "dods://h/a/x.nc.info",
                           "https://h/thredds/dodsC/a/x.nc.ascii"}) {
    EXPECT_THAT(locate_url(page).error().message, HasSubstr("without this ending")) << page;
  }
  for (const char* page : {"https://h/thredds/catalog/a/catalog.html?dataset=x",
                           "https://h/thredds/catalog/a/catalog.xml"}) {
    EXPECT_THAT(locate_url(page).error().message, HasSubstr("is a page of a catalogue")) << page;
  }
  EXPECT_TRUE(locate_url("https://h/x.html"));
  // The dataset of /dodsC/ needs no other scheme; that of another service does.
  EXPECT_THAT(locate_url("https://h/thredds/dodsC/x.nc.html").error().message,
              AllOf(HasSubstr("without this ending (.html)"), Not(HasSubstr("dods:"))));
  EXPECT_THAT(locate_url("https://h/opendap/x.nc.html").error().message,
              HasSubstr("without this ending (.html), and as dods://HOST/PATH"));
}

TEST(UrlLocation, OtherSchemesAreToldWhichAreSupported) {
  for (const char* text : {"ftp://h/x.nc", "gopher://h/x.nc", "file:///x.nc"}) {
    EXPECT_THAT(locate_url(text).error().message,
                HasSubstr("https, http, s3 and dods (a dataset of an OPeNDAP service)"))
        << text;
  }
}

TEST(UrlLocation, ServicesHaveASchemeOrTheirPathOnThredds) {
  const auto named = locate_url("DODS://h/opendap/x.nc?number=3");
  ASSERT_TRUE(named) << named.error().message;
  EXPECT_TRUE(named->service && named->fetched);
  EXPECT_EQ(named->members[0].name, "x.nc");
  EXPECT_EQ(named->members[0].path, "https://h/opendap/x.nc");
  EXPECT_EQ(selection_text(named->selection), "number=3");
  EXPECT_TRUE(locate_url("http://h/thredds/dodsC/a/x.zarr")->service);
  EXPECT_FALSE(locate_url("https://h/x.nc")->service);
  EXPECT_FALSE(locate_url("dods://h/"));
  EXPECT_FALSE(locate_url("dods://h/folder/"));
  EXPECT_FALSE(locate_url("s3://bucket/dodsC/x.nc"));
}

TEST(UrlLocation, NothingIsOpenedOnDiskForAUrl) {
  const auto files = direct_files(locate("https://h/x.zarr").value());
  EXPECT_FALSE(files->exists(".zgroup"));
  EXPECT_THAT(files->open(".zgroup").error().message, HasSubstr("--data-host"));
  EXPECT_THAT(files->list("").error().message, HasSubstr("--data-host"));
}

}  // namespace
}  // namespace windsplat::data
