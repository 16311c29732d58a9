// A Modbus/TCP Security client of the Go package simonvetter/modbus.
// Usage: go_client ADDRESS:PORT CERTIFICATE KEY AUTHORITY. Prints what a read and a write of register 10 come to.
package main

import (
	"crypto/tls"
	"fmt"
	"os"
	"time"

	"github.com/simonvetter/modbus"
)

func must(err error) {
	if err != nil {
		fmt.Println("error:", err)
		os.Exit(1)
	}
}

func main() {
	own, err := tls.LoadX509KeyPair(os.Args[2], os.Args[3])
	must(err)
	authorities, err := modbus.LoadCertPool(os.Args[4])
	must(err)
	client, err := modbus.NewClient(&modbus.ClientConfiguration{
		URL:           "tcp+tls://" + os.Args[1],
		TLSClientCert: &own,
		TLSRootCAs:    authorities,
		Timeout:       5 * time.Second,
	})
	must(err)
	must(client.Open())
	defer client.Close()
	value, err := client.ReadRegister(10, modbus.HOLDING_REGISTER)
	fmt.Println("read:", value, err)
	fmt.Println("write:", client.WriteRegister(10, 7))
	value, err = client.ReadRegister(10, modbus.HOLDING_REGISTER)
	fmt.Println("read:", value, err)
}
